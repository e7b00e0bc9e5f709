"""Fitting: what the tests show at and below the knee enters; guarded thresholds and certified curves leave."""
