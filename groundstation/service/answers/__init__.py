"""What operators and screens are shown: views, their fields and the paths below ground/."""
