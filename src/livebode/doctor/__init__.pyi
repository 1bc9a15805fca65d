from livebode.doctor.bundle import write_bundle as write_bundle
from livebode.doctor.check import Check as Check
from livebode.doctor.check import Verdict as Verdict
from livebode.doctor.check import worst as worst
from livebode.doctor.examination import examine as examine
from livebode.doctor.subject import Subject as Subject
