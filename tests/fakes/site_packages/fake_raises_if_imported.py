"""Stands for a module that must not be imported: doing so fails the test."""

raise AssertionError("this module must never be imported")
