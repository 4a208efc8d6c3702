/* A-format: three encoders on one line, asked at once, over a port that hands over what came until the line went idle. */
#include "servowire.h"

enum { ENCODERS = 3, ALL = (1 << ENCODERS) - 1, ABS40_MT = 4, MAX_AGE_NS = 250000 };

/* Of the firmware around it. */
void port_send(const uint16_t *contents, uint8_t count); /* start bit, content with its bit 0 first, delimiter */
void motor_set_angle(uint8_t motor, uint32_t angle);
void motor_off(uint8_t motor);

static sw_aformat_t line;

void bus_init(void);
void bus_control(uint64_t now);
void bus_received(const uint16_t *contents, const uint8_t *framed, size_t count, uint64_t end);

void bus_init(void)
{
    static const sw_aformat_encoder_t encoder = {17, 16, 0};
    (void)sw_aformat_init(&line, 4000000, &encoder);
    (void)sw_aformat_set_hand_over(&line, 5000, ENCODERS - 1);
}

void bus_control(uint64_t now)
{
    sw_aformat_transmission_t tx;
    uint8_t motor;

    (void)sw_aformat_poll(&line, now);
    for (motor = 0; motor < ENCODERS; motor++) {
        uint32_t angle;
        if (sw_aformat_angle(&line, motor, now, MAX_AGE_NS, &angle)) {
            motor_set_angle(motor, angle);
        } else {
            motor_off(motor);
        }
    }
    if (sw_aformat_read(&line, ABS40_MT, ALL, now, &tx) == SW_SEND) {
        port_send(tx.contents, tx.len);
    }
}

void bus_received(const uint16_t *contents, const uint8_t *framed, size_t count, uint64_t end)
{
    (void)sw_aformat_hear(&line, contents, framed, count, end);
}
