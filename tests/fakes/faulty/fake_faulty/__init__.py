"""A plugin for each thing that a plugin can do wrong."""
