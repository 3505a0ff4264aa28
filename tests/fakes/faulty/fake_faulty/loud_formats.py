"""A recording format whose module prints."""

from fake_faulty.formats import Folders as Folders

print("welcome to the format")
