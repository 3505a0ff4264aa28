"""Virtual presses with the truth attached."""
