"""The language of the string: messages, codec, link, transports. Imports nothing else of ours."""

__distribution__ = "borechain"  # what packages of the same name do not have
