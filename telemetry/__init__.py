"""The language of the string: messages, codec, link, transports. Imports nothing else of ours."""
