"""Names of fitted quantities as a person reads them in English; the catalogues have those of the other languages."""

QUANTITY_NAMES = {
    "J": "inertia",
    "Js": "motor inertia",
    "JL": "load inertia",
    "mL": "load mass",
    "J2": "middle inertia",
    "J3": "load inertia",
    "m2": "middle mass",
    "m3": "load mass",
    "Keff": "belt stiffness",
    "K1": "first stiffness",
    "K2": "second stiffness",
    "bs": "belt damping",
    "b1": "first damping",
    "b2": "second damping",
    "B": "friction at the motor",
    "BL": "friction at the load",
    "resonance damping": "resonance damping ratio",
    "resonance q": "resonance quality factor",
    "antiresonance damping": "antiresonance damping ratio",
    "antiresonance q": "antiresonance quality factor",
}
"""By the symbol in files and in Python; of a name of several words with spaces."""
