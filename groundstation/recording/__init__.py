"""Recordings of a rig: MCAP files of everything that its ground station took in and answered."""
