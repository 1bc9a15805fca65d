"""Controllers that `livebode measure` plays an excitation on."""
