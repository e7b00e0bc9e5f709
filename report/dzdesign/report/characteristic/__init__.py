"""The valve's characteristic, without and with the compensator: artefacts enter, curves and quantities leave."""
