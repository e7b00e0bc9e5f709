"""Reading: recordings of any format enter, `RampTest`s in SI units leave."""
