"""The light in an image: how it differs from the reference, and what is known of it."""
