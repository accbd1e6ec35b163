"""Figures and reports of surveys, instruments and walls."""
