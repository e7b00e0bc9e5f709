"""The bundled example: small ramp tests of a simulated valve like the paper's, and the plant that made them."""
