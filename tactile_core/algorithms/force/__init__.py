"""Force: the mechanics of an elastic layer, and regression of forces that were measured."""
