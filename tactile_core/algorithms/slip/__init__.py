"""Slip detection: from the displacement field and from the imprint of the object."""
