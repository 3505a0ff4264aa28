"""What is measured on recordings and on virtual sensors: benchmarks print it, tests assert on it.

Imports the package and its plugins, and neither tests nor benchmarks.
"""
