"""Commands about the scenarios that come with the program."""
