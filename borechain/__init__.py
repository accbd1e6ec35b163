"""The command ``borechain``: one small file a sub-command, each importing what it needs when it runs."""

__version__ = "0.1.0"

__distribution__ = "borechain"  # what packages of the same name do not have
