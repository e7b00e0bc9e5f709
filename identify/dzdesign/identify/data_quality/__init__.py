"""Data quality: what is weak in recordings and tests, as warnings with numbers and what to do."""
