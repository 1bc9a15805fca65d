"""Doctor: what a person asks first when something does not work, and a bundle for a report (docs/how-to/doctor.md)."""

from livebode.doctor.bundle import write_bundle
from livebode.doctor.check import Check, Verdict, worst
from livebode.doctor.examination import examine
from livebode.doctor.subject import Subject

__all__ = ["Check", "Subject", "Verdict", "examine", "worst", "write_bundle"]
