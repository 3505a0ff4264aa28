"""Small mistakes, made one by one in a copy of the tree, each of which a test has to notice."""
