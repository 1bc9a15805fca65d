from livebode.reporting.compare_report import Comparison as Comparison
from livebode.reporting.compare_report import comparison_of as comparison_of
from livebode.reporting.first_page import trusted as trusted
