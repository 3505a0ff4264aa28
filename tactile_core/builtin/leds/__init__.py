"""Light drivers: boxes of LEDs at a serial port or at USB, and lights on a camera's own control."""
