"""The pictures of a run: Bode plot and tracking as PNG, and a Bode plot for the terminal.

The import is cheap: Matplotlib is loaded when the first picture is drawn.
"""

from livebode.report.bode import bode_figure
from livebode.report.excitation import excitation_figure, save_excitation_picture
from livebode.report.friction import friction_figure, save_friction_picture
from livebode.report.loop import loop_figure, save_loop_picture
from livebode.report.matrix import matrix_figure, save_matrix_pictures, singular_values_figure
from livebode.report.matrix_excitation import matrix_excitation_figure, save_matrix_excitation_picture
from livebode.report.orders import orders_figure, save_orders_picture
from livebode.report.pictures import save_pictures
from livebode.report.terminal import terminal_bode
from livebode.report.tracking import tracking_figure
from livebode.report.tuning import save_tuning_picture, tuning_figure
from livebode.report.validation import save_validation_picture, validation_figure

__all__ = [
    "bode_figure",
    "excitation_figure",
    "friction_figure",
    "loop_figure",
    "matrix_excitation_figure",
    "matrix_figure",
    "orders_figure",
    "save_excitation_picture",
    "save_friction_picture",
    "save_loop_picture",
    "save_matrix_excitation_picture",
    "save_matrix_pictures",
    "save_orders_picture",
    "save_pictures",
    "save_tuning_picture",
    "save_validation_picture",
    "singular_values_figure",
    "terminal_bode",
    "tracking_figure",
    "tuning_figure",
    "validation_figure",
]
