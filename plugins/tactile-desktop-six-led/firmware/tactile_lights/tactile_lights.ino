// Six dimmed lights on an Arduino with an ATmega328P (Uno, Nano, Pro Mini) at 16 MHz.
//
// Lights 1 to 6 are at pins 3, 5, 6, 9, 10 and 11, each through a transistor. The protocol is that of
// docs/reference/light-protocol.md. Give every box its own serial number and upload.

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <util/crc16.h>
#include <util/delay.h>

#ifndef SERIAL_NUMBER
#define SERIAL_NUMBER "L0001"  // letters, digits, '-' and '_'
#endif
#ifndef SETTLE_MS
#define SETTLE_MS 1  // a white LED's phosphor decays in less than this
#endif

#define PROTOCOL "1"
#define FIRMWARE "1.0"
#define WATCHDOG WDTO_2S
#define WATCHDOG_MS 2000
#define LINE_BYTES 64
#define LIGHTS 6

struct Output {
    volatile uint8_t *level;    // low byte of the compare register: the timers count to 255
    volatile uint8_t *control;  // register that connects the timer to the pin
    uint8_t connect;
    volatile uint8_t *port, *direction;
    uint8_t pin;
};

static const Output OUTPUTS[LIGHTS] = {
    {&OCR2B, &TCCR2A, _BV(COM2B1), &PORTD, &DDRD, PD3},
    {&OCR0B, &TCCR0A, _BV(COM0B1), &PORTD, &DDRD, PD5},
    {&OCR0A, &TCCR0A, _BV(COM0A1), &PORTD, &DDRD, PD6},
    {&OCR1AL, &TCCR1A, _BV(COM1A1), &PORTB, &DDRB, PB1},
    {&OCR1BL, &TCCR1A, _BV(COM1B1), &PORTB, &DDRB, PB2},
    {&OCR2A, &TCCR2A, _BV(COM2A1), &PORTB, &DDRB, PB3},
};

static void shine(const Output &output, uint8_t level) {
    *output.level = level;
    if (level)
        *output.control |= output.connect;
    else  // a connected timer would still pulse once a period; the pin itself stays low
        *output.control &= ~output.connect;
}

static void darken() {
    for (uint8_t i = 0; i < LIGHTS; i++) shine(OUTPUTS[i], 0);
}

// No valid line has arrived for two seconds: the program has ended or the cable is off. This counter has
// an oscillator of its own, and runs whatever the main loop does.
ISR(WDT_vect) { darken(); }

static void feed_watchdog() {
    uint8_t status = SREG;
    cli();
    wdt_reset();
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDIE) | (WATCHDOG & 7);  // an interrupt, not a reset: old bootloaders hang on that
    SREG = status;
}

static uint8_t sum;  // of the line that is being sent

static void send(char character) {
    while (!(UCSR0A & _BV(UDRE0)));
    UDR0 = character;
}

static void say(const char *text) {
    for (; *text; text++) {
        send(*text);
        sum = _crc8_ccitt_update(sum, *text);
    }
}

static void say(uint16_t number) {
    char digits[6];
    utoa(number, digits, 10);
    say(digits);
}

static void end_line() {
    static const char HEX_DIGITS[] = "0123456789ABCDEF";
    uint8_t total = sum;
    send('*');
    send(HEX_DIGITS[total >> 4]);
    send(HEX_DIGITS[total & 15]);
    send('\n');
    sum = 0;
}

static void hello(uint16_t number) {
    say("HELLO ");
    say(number);
    say(" " PROTOCOL " tactile-lights " FIRMWARE " " SERIAL_NUMBER " ");
    say(LIGHTS);
    say(" ");
    say(SETTLE_MS);
    say(" ");
    say(WATCHDOG_MS);
    end_line();
}

static void acknowledge(uint16_t number) {
    say("OK ");
    say(number);
    end_line();
}

static void refuse(uint16_t number, const char *reason) {
    say("ERR ");
    say(number);
    say(" ");
    say(reason);
    end_line();
}

// The next word as a number of 0 to 255; -1 if there is none, or another.
static int16_t next_number(char **words) {
    char *word = strtok_r(0, " ", words);
    if (!word || !*word || strlen(word) > 3) return -1;
    for (char *digit = word; *digit; digit++)
        if (*digit < '0' || *digit > '9') return -1;
    int16_t number = atoi(word);
    return number > 255 ? -1 : number;
}

static void set_levels(uint8_t number, char **words) {
    uint8_t levels[LIGHTS];
    for (uint8_t i = 0; i < LIGHTS; i++) {
        int16_t level = next_number(words);
        if (level < 0) return refuse(number, "LEVELS");
        levels[i] = level;
    }
    if (strtok_r(0, " ", words)) return refuse(number, "LEVELS");
    feed_watchdog();
    cli();  // all change at once
    for (uint8_t i = 0; i < LIGHTS; i++) shine(OUTPUTS[i], levels[i]);
    sei();
    _delay_ms(SETTLE_MS);
    acknowledge(number);
}

// Remove the checksum from the end of a line; whether it is right.
static bool checked(char *line) {
    char *star = strrchr(line, '*');
    if (!star || strlen(star) != 3) return false;
    uint8_t expected = 0;
    for (char *character = line; character < star; character++)
        expected = _crc8_ccitt_update(expected, *character);
    *star = 0;
    char *end;
    return strtoul(star + 1, &end, 16) == expected && !*end;
}

static void answer(char *line) {
    if (!checked(line)) return refuse(0, "CHECKSUM");
    char *words;
    char *command = strtok_r(line, " ", &words);
    int16_t number = next_number(&words);
    if (!command || number < 1) return refuse(0, "COMMAND");
    if (!strcmp(command, "SET")) return set_levels(number, &words);
    if (!strcmp(command, "ALIVE")) {
        feed_watchdog();
        return acknowledge(number);
    }
    if (!strcmp(command, "HELLO")) {
        feed_watchdog();
        return hello(number);
    }
    refuse(number, "COMMAND");
}

void setup() {
    MCUSR = 0;   // after a reset by the watchdog it would go on resetting
    TIMSK0 = 0;  // Arduino's clock would interrupt at every period of the lights
    for (uint8_t i = 0; i < LIGHTS; i++) {
        *OUTPUTS[i].port &= ~_BV(OUTPUTS[i].pin);
        *OUTPUTS[i].direction |= _BV(OUTPUTS[i].pin);
    }
    // Fast PWM of 62.5 kHz: a millisecond's exposure has 62 periods, so that it varies by 2 % at most
    TCCR0A = _BV(WGM01) | _BV(WGM00);
    TCCR0B = _BV(CS00);
    TCCR1A = _BV(WGM10);
    TCCR1B = _BV(WGM12) | _BV(CS10);
    TCCR2A = _BV(WGM21) | _BV(WGM20);
    TCCR2B = _BV(CS20);
    darken();
    UBRR0 = 3;  // 500000 baud with double speed, without an error of the clock's division
    UCSR0A = _BV(U2X0);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    feed_watchdog();
    sei();
    hello(0);
}

void loop() {
    static char line[LINE_BYTES];
    static uint8_t length;
    static bool overflowed;
    if (!(UCSR0A & _BV(RXC0))) return;
    char character = UDR0;
    if (character == '\r') return;
    if (character != '\n') {
        if (length < LINE_BYTES - 1)
            line[length++] = character;
        else
            overflowed = true;
        return;
    }
    line[length] = 0;
    if (overflowed)
        refuse(0, "LENGTH");
    else if (length)
        answer(line);
    length = 0;
    overflowed = false;
}
