"""The published form of the filter, for the published experiments: Euler angles, explicit steps, feed-forward."""
