"""The HTML report and its figures."""

from tauhat.report.page import write_motion_report, write_report
from tauhat.report.sensing_page import write_sensing_report
from tauhat.report.study_page import write_study
from tauhat.report.task_page import write_task_report
from tauhat.report.thinning import thinned, thinned_cloud
from tauhat.report.tracking_page import write_tracking_report

__all__ = [
    "thinned",
    "thinned_cloud",
    "write_motion_report",
    "write_report",
    "write_sensing_report",
    "write_study",
    "write_task_report",
    "write_tracking_report",
]
