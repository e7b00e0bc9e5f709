"""Assess: recordings without and with the compensator enter, an `Assessment` leaves. Imports identify and core only."""
