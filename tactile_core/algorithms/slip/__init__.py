"""Whether the skin still follows the object that drags it."""
