"""The ground station as a process: what comes in, what is learnt from it, and who may ask and order."""
