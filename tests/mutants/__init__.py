"""Mutation tests: small mistakes in a copy of the tree, each of which a test must detect."""
