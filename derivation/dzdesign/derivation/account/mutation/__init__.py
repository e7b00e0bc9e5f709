"""How sharp the account is: wrong statements of every kind, and how many of them show."""
