"""A run for other programs: CSV, MATLAB, NetCDF, UFF 58, xarray and python-control."""

from livebode.export.delimited import write_csv
from livebode.export.formats import ENDINGS, FORMATS, MATRIX_FORMATS, TABLES, save
from livebode.export.labelled import write_netcdf
from livebode.export.lpv import MODELS, LpvModel
from livebode.export.matlab import write_mat
from livebode.export.matrix_delimited import write_matrix_csv
from livebode.export.matrix_labelled import write_matrix_netcdf
from livebode.export.matrix_matlab import write_matrix_mat
from livebode.export.matrix_universal import write_matrix_uff
from livebode.export.parameters import ParameterTable, write_parameters_csv, write_parameters_mat
from livebode.export.result import WriteResult
from livebode.export.selection import at
from livebode.export.universal import write_uff

__all__ = [
    "ENDINGS",
    "FORMATS",
    "MATRIX_FORMATS",
    "MODELS",
    "TABLES",
    "LpvModel",
    "ParameterTable",
    "WriteResult",
    "at",
    "save",
    "write_csv",
    "write_mat",
    "write_matrix_csv",
    "write_matrix_mat",
    "write_matrix_netcdf",
    "write_matrix_uff",
    "write_netcdf",
    "write_parameters_csv",
    "write_parameters_mat",
    "write_uff",
]
