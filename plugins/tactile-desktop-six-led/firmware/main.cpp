// The sketch as a program of its own, for avr-g++ without the Arduino IDE:
//
//   avr-g++ -mmcu=atmega328p -DF_CPU=16000000UL -Os -o tactile_lights.elf main.cpp
//   avr-objcopy -O ihex tactile_lights.elf tactile_lights.hex
//   avrdude -c arduino -p m328p -P /dev/ttyACM0 -U flash:w:tactile_lights.hex

#include "tactile_lights/tactile_lights.ino"

int main() {
    setup();
    for (;;) loop();
}
