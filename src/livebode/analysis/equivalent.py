"""The plant that one controller of a matrix loop sees while the other controllers are active."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.core import MatrixLoop, MatrixResponses, Responses


def equivalent_plant(responses: MatrixResponses, loop: MatrixLoop, output: str, input: str) -> Responses:
    """The response from an input to an output with all controllers active except the one between the two.

    With F without that controller, y = (I + G·F)⁻¹·G·u, of which this is one entry (Skogestad and Postlethwaite,
    Multivariable Feedback Control, 2005, section 10.6). An error δ of G moves it to first order by a·δ·b with
    a = the output's row of (I + G·F)⁻¹ and b = the input's column of (I + F·G)⁻¹, so that its variance is that of the
    whole covariance: a·noise·a* times bᵀ·spread·b̄. If nothing else is joined it is the entry itself.

    Delay: that of the matrices. Bias: of second order in the noise, large only where I + G·F is nearly singular, which
    is where the other loops alone are nearly unstable.

    Parameters
    ----------
    responses
        Matrices G, any number of rows.
    loop
        Its feedback F has the rows of the inputs and the columns of the outputs of `responses`.
    output, input
        Names of the signals of the controller that is left out.

    Returns
    -------
    Responses
        A row for each matrix; valid where all columns are. The coherence is the least of all outputs.

    Raises
    ------
    UsageError
        If there is no such signal, or the feedback is missing.

    Examples
    --------
    >>> from livebode import PID
    >>> from livebode.core import MatrixLoop
    >>> from livebode_matrix import example_matrix_responses
    >>> velocity = PID(gain=0.3, integral_time_s=0.05, rate_hz=4000)
    >>> loop = MatrixLoop(feedback=[[velocity, None], [None, velocity]])
    >>> equivalent_plant(example_matrix_responses(), loop, "velocity1", "u1").value.shape
    (3, 7)
    """
    entry = responses.entry(output, input)
    o, i = responses.outputs.index(output), responses.inputs.index(input)
    feedback = loop.feedback_at(responses.frequency_hz)
    feedback[:, i, o] = 0
    valid = np.asarray(responses.valid.all(axis=2))
    plant = np.where(valid[..., np.newaxis, np.newaxis], responses.value, 0)
    a = np.linalg.inv(np.eye(len(responses.outputs)) + plant @ feedback)[..., o, :]
    b = np.linalg.inv(np.eye(len(responses.inputs)) + feedback @ plant)[..., :, i]
    value = np.einsum("rkp,rkp->rk", a, plant[..., i])
    noise = np.einsum("rko,rkop,rkp->rk", a, responses.noise, np.conj(a)).real
    spread = np.einsum("rki,rkij,rkj->rk", b, responses.spread, np.conj(b)).real
    # All entries may vary together.
    variation = np.einsum("rko,rkoi,rki->rk", np.abs(a), responses.variation, np.abs(b))
    variance = np.maximum(noise * spread, 0) + np.nan_to_num(variation) ** 2
    return replace(
        entry,
        value=np.where(valid, value, np.nan),
        sigma=np.where(valid, np.sqrt(variance), np.nan),
        variation=variation,
        coherence=responses.coherence.min(axis=2),
        valid=valid,
    )
