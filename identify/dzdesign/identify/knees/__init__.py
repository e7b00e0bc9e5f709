"""Knees: branches enter; the linear region, the knee, the first flow seen and the noise of each leave."""
