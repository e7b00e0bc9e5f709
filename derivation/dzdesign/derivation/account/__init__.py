"""The account of the paper: statements with their premises enter, proofs, verdicts and theorems leave."""
