from livebode.mimo.equivalent import equivalent_plant as equivalent_plant
from livebode.mimo.excitation import MatrixExcitation as MatrixExcitation
from livebode.mimo.loop import MatrixLoop as MatrixLoop
from livebode.mimo.mean import mean_matrix as mean_matrix
from livebode.mimo.prediction import MatrixPrediction as MatrixPrediction
from livebode.mimo.prediction import predict as predict
from livebode.mimo.prediction import within_limits as within_limits
