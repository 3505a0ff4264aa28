"""What a plugin implements, and the plain values that tell it what sensor it is part of.

May import views, formats, algorithms, quantities and errors.
"""
