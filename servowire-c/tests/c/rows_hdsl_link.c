/* HIPERFACE DSL: a receiver with its register map, fed with answers. */
#include "rows.h"

typedef struct {
    sw_hdsl_t m;
    sw_hdsl_registers_t map;
} bench_t;

static void start(bench_t *b, uint8_t dialect)
{
    (void)sw_hdsl_start(&b->m, dialect, 0);
    (void)sw_hdsl_registers_start(&b->map, dialect);
}

/* The window of an answer that comes after this delay, in eighths of a bit; the line is high before and after it. */
static void hear(bench_t *b, uint64_t bits, unsigned delay)
{
    uint8_t samples[SW_HDSL_WINDOW];
    unsigned at;
    memset(samples, 0xff, sizeof samples);
    for (at = 0; at < SW_HDSL_ANSWER_BITS * 8; at++) {
        unsigned to = at + delay;
        if (!(bits >> at / 8 & 1) && to < 8 * SW_HDSL_WINDOW) {
            samples[to / 8] = (uint8_t)(samples[to / 8] & ~(0x80u >> to % 8));
        }
    }
    (void)sw_hdsl_hear(&b->m, samples, sizeof samples, 0);
    (void)sw_hdsl_registers_apply(&b->map, &b->m);
}

static void feed(bench_t *b, uint64_t bits) { hear(b, bits, 8); }

static uint64_t registers(bench_t *b, uint8_t from, int count)
{
    uint64_t all = 0;
    uint8_t byte = 0;
    while (count-- > 0) {
        (void)sw_hdsl_registers_look(&b->map, from++, &byte);
        all = all << 8 | byte;
    }
    return all;
}

/* Six characters, special where the bit in `special` is set, each in column RD-, with the switch bit after the fifth. */
static uint64_t answer_of(const uint8_t *bytes, unsigned special)
{
    uint64_t bits = 0;
    int k;
    for (k = 0; k < 6; k++) {
        sw_hdsl_character_t it;
        int8_t rd = -1;
        uint16_t word = 0;
        it.byte = bytes[k];
        it.special = special >> k & 1;
        (void)sw_hdsl_build_word(&it, &rd, &word);
        bits |= (uint64_t)word << (10 * k + (k == 5));
    }
    return bits | (uint64_t)!(bits >> 49 & 1) << 50;
}

static void seal(uint8_t *block)
{
    uint16_t crc = 0;
    (void)sw_hdsl_crc16(block, 6, &crc);
    block[6] = (uint8_t)(crc >> 8);
    block[7] = (uint8_t)crc;
}

/* An encoder at standstill at position 0 that says what it is told to. */
typedef struct {
    int at;
} encoder_t;

/* A safe channel 1 with this summary; with a wrong CRC, or with the mark of no position. */
static void v_block(uint8_t *block, uint8_t summary, char kind)
{
    memset(block, 0, 8);
    block[0] = summary;
    if (kind == 'i') {
        memset(block + 1, 0xfd, 5);
    }
    seal(block);
    if (kind == 'c') {
        block[7] ^= 1;
    }
}

static uint64_t next(encoder_t *e, uint8_t symbol, uint16_t acceleration, const uint8_t *block, unsigned special)
{
    uint8_t second[8] = {0x1c}, bytes[6];
    unsigned marks = 1u << 2;
    seal(second);
    bytes[0] = block[e->at];
    bytes[1] = (uint8_t)(symbol | (e->at == 7 ? 0x80 : 0));
    bytes[2] = 0xfe; /* K30.7 */
    bytes[3] = (uint8_t)(acceleration >> 8);
    bytes[4] = (uint8_t)acceleration;
    bytes[5] = second[e->at];
    marks |= (special >> e->at & 1) | (e->at == 0 ? 1u << 5 : 0);
    e->at = (e->at + 1) % 8;
    return answer_of(bytes, marks);
}

static uint64_t next_good(encoder_t *e, uint8_t symbol)
{
    uint8_t block[8];
    v_block(block, 0, 'o');
    return next(e, symbol, 0x001f, block, 0);
}

static uint8_t parameter_of(const bench_t *b, sw_hdsl_transmission_t *to_send)
{
    sw_hdsl_head_t head;
    uint8_t parameter = 0, extra;
    (void)sw_hdsl_transmission(&b->m, to_send);
    memset(&head, 0, sizeof head);
    memcpy(head.bits, to_send->head, sizeof head.bits);
    head.len = to_send->head_bits;
    (void)sw_hdsl_parse_head(&head, &parameter, &extra);
    return parameter;
}

static uint8_t symbol_of(const bench_t *b)
{
    sw_hdsl_transmission_t to_send;
    return parameter_of(b, &to_send) & 0x1f;
}

/* Locked, so that the next answer is the first of a V-frame. */
static int lock(bench_t *b, uint8_t dialect, uint8_t pos_bits)
{
    uint16_t id = (uint16_t)(3 | (pos_bits - 11) << 4);
    uint8_t bytes[6];
    int k;
    bytes[0] = bytes[4] = (uint8_t)id;
    bytes[1] = bytes[3] = (uint8_t)(id >> 8);
    bytes[2] = bytes[5] = 0;
    start(b, dialect);
    for (k = 0; k < 200; k++) {
        uint8_t waiting[6] = {0, 0x90, 0xfe, 0x00, 0x1f, 0};
        switch (sw_hdsl_state(&b->m)) {
        case SW_HDSL_RUNNING: return 1;
        case SW_HDSL_IDREQ: feed(b, answer_of(bytes, 0)); break;
        case SW_HDSL_WAIT_VSYNC: feed(b, answer_of(waiting, 1u << 2)); break;
        default: feed(b, SW_HDSL_TEST_PATTERN); break;
        }
    }
    say("does not lock");
    return 0;
}

/* Bits that were sent, as text. */
static char sent[16384];
static size_t sent_len;

static void send_bits(const uint8_t *bits, unsigned len)
{
    unsigned k;
    for (k = 0; k < len && sent_len + 1 < sizeof sent; k++) {
        sent[sent_len++] = bits[k / 8] >> k % 8 & 1 ? '1' : '0';
    }
    sent[sent_len] = 0;
}

static void say_start_up(bench_t *b, const char *qm, int identified)
{
    say(" %s", sent_len > 0 ? sent : "-");
    /* After a failed identification the firmware leaves MASTER_QM: the row's own value then. */
    if (identified) {
        say(" %02x", (unsigned)registers(b, 0x03, 1));
    } else {
        say(" %s", qm);
    }
    say(" %u", (unsigned)registers(b, 0x0a, 1) & 15);
    {
        sw_hdsl_frame_t frame;
        (void)sw_hdsl_frame(&b->m, &frame);
        say(" %u %06x %04x", frame.restarts, (unsigned)registers(b, 0x0d, 3), (unsigned)registers(b, 0x50, 2));
    }
    sent_len = 0;
    sent[0] = 0;
}

/* DELAY, then a row each: ANSWER,MASTER_QM */
static void start_up(char **a, int n)
{
    static bench_t b, before;
    static const uint8_t filler[10] = {0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa};
    unsigned delay = (unsigned)number(a[0]) * 8;
    int identified = 1, k = 1;
    sw_hdsl_frame_t frame;
    uint32_t id = 0;
    sent_len = 0;
    start(&b, SW_HDSL_TI);
    for (;;) {
        sw_hdsl_transmission_t to_send;
        static const uint8_t zeros[16];
        uint8_t parameter = parameter_of(&b, &to_send);
        char *qm;
        send_bits(zeros, to_send.lead_in);
        send_bits(to_send.head, to_send.head_bits);
        if (!to_send.answered) {
            send_bits(filler, 74);
            hear(&b, UINT64_MAX, 8);
            (void)sw_hdsl_frame(&b.m, &frame);
            send_bits(frame.tail, frame.tail_bits);
            continue;
        }
        identified |= (int)(registers(&b, 0x03, 1) >> 7 & 1);
        if (k >= n) {
            break;
        }
        qm = strchr(a[k], ',');
        *qm++ = 0;
        say(" %02x", parameter);
        say_start_up(&b, qm, identified);
        before = b;
        hear(&b, a[k][0] == '-' ? UINT64_MAX : line_bits(a[k]), delay);
        k++;
        (void)sw_hdsl_frame(&b.m, &frame);
        send_bits(frame.tail, frame.tail_bits);
        identified &= frame.restarted != SW_HDSL_RESTART_IDENTIFIER;
        identified |= sw_hdsl_state(&b.m) == SW_HDSL_WAIT_VSYNC;
        if (frame.restarted != SW_HDSL_NO_RESTART && !frame.cut) {
            /* A row of its own for what was sent when the master gave up, with the registers before that. */
            if (k >= n) {
                break;
            }
            qm = strchr(a[k++], ',') + 1;
            say(" gave up");
            say_start_up(&before, qm, identified);
        }
    }
    if (sw_hdsl_encoder_id(&b.m, &id) == SW_OK) {
        say(" id %05x", id);
    } else {
        say(" no id");
    }
}

/* DIALECT POS_BITS NOISE, answers; after the last one "lost" if it ends the link. */
static void link_of(char **a, int n)
{
    static bench_t b;
    /* A symbol made by noise opens a message, after which the firmware shows MIN for a frame. */
    uint64_t unsure = U8(a[2]) ? (uint64_t)0x0040 << 32 | (uint64_t)0x0040 << 16 : 0;
    sw_hdsl_frame_t frame;
    int k;
    if (!lock(&b, U8(a[0]), U8(a[1]))) {
        return;
    }
    for (k = 3; k < n; k++) {
        int lost = a[k][0] == 'L';
        feed(&b, line_bits(a[k] + lost));
        (void)sw_hdsl_frame(&b.m, &frame);
        if (lost) {
            say(" restarted %u link %u", frame.restarted, (unsigned)registers(&b, 0x03, 1) >> 7);
            continue;
        }
        say(frame.restarted ? " restarted" : " %02x", (unsigned)registers(&b, 0x03, 1));
        say(" %010llx %06x", (unsigned long long)registers(&b, 0x10, 5), (unsigned)registers(&b, 0x15, 3));
        say(" %012llx", (unsigned long long)(registers(&b, 0x50, 6) & ~unsure));
        say(" %u %d %014llx", (unsigned)registers(&b, 0x38, 1), sw_hdsl_registers_stage(&b.map), (unsigned long long)registers(&b, 0x19, 7));
        say(" %02x %016llx", (unsigned)registers(&b, 0x36, 1), (unsigned long long)registers(&b, 0x46, 8));
    }
}

static sw_result_t put(bench_t *b, uint8_t address, uint8_t value)
{
    return sw_hdsl_registers_write(&b->map, &b->m, address, value);
}

/* "new" or "on", then writes of the application ADDRESS=VALUE up to "|", then the encoder's symbols; they begin after the first. */
static void messages(char **a, int n)
{
    static bench_t b;
    static encoder_t e;
    int k, bar = 1, at;
    if (strcmp(a[0], "new") == 0) {
        e.at = 0;
        if (!lock(&b, SW_HDSL_TI, 32)) {
            return;
        }
        /* One V-frame has to pass before messages are sent. */
        for (k = 0; k < 15; k++) {
            feed(&b, next_good(&e, 0x10));
        }
    }
    while (bar < n && strcmp(a[bar], "|") != 0) {
        bar++;
    }
    for (k = bar + 1, at = 0; k < n; k++, at++) {
        if (at == 1) {
            int w;
            for (w = 1; w < bar; w++) {
                char *value = strchr(a[w], '=');
                sw_result_t r = put(&b, (uint8_t)strtoul(a[w], NULL, 16), (uint8_t)strtoul(value + 1, NULL, 16));
                if (r != SW_OK) {
                    say(" write %s", sw_text(r));
                }
            }
        }
        say(" %u", symbol_of(&b));
        feed(&b, next_good(&e, U8(a[k])));
    }
    say(" | %04x %016llx %02x", (unsigned)registers(&b, 0x28, 2), (unsigned long long)registers(&b, 0x20, 8), (unsigned)registers(&b, 0x37, 1));
    say(" %04x %02x", (unsigned)registers(&b, 0x04, 2), (unsigned)registers(&b, 0x3d, 1));
}

static void idle(bench_t *b, encoder_t *e, unsigned long count)
{
    while (count-- > 0) {
        feed(b, next_good(e, 0x10));
    }
}

/* An application with its receiver: w,ADDRESS,VALUE  r,ADDRESS,MASK  idle,N  bad,N  init,N  v,SUMMARY,KIND  sent,SYMBOLS  answer,SYMBOLS */
static void operations(char **a, int n)
{
    static bench_t b;
    encoder_t e = {0};
    static const uint8_t id[6] = {0x53, 0x01, 0x00, 0x01, 0x53, 0x00};
    uint8_t block[8];
    int k, j;
    start(&b, SW_HDSL_SICK);
    /* RESET 2, SYNC 16, START 9, LEARN 9, CHECK 16: the test pattern where it is asked for. */
    for (k = 0; k < 52; k++) {
        feed(&b, SW_HDSL_TEST_PATTERN);
    }
    feed(&b, answer_of(id, 0));
    idle(&b, &e, 8 + 48);
    (void)put(&b, 0x04, 0);
    (void)put(&b, 0x05, 0);
    (void)put(&b, 0x3d, 0);
    say("locked %02x", (unsigned)registers(&b, 0x03, 1));
    for (k = 0; k < n; k++) {
        char *what = strtok(a[k], ","), *first = strtok(NULL, ","), *second = strtok(NULL, ",");
        unsigned long count = first == NULL ? 0 : strtoul(first, NULL, 10);
        uint8_t byte = first == NULL ? 0 : (uint8_t)strtoul(first, NULL, 16), got = 0;
        if (strcmp(what, "w") == 0) {
            sw_result_t r = put(&b, byte, (uint8_t)strtoul(second, NULL, 16));
            say(" %s", sw_text(r));
        } else if (strcmp(what, "r") == 0) {
            say(" %s", sw_text(sw_hdsl_registers_read(&b.map, byte, &got)));
            say(" %02x", got & (unsigned)strtoul(second, NULL, 16));
        } else if (strcmp(what, "idle") == 0) {
            idle(&b, &e, count);
        } else if (strcmp(what, "bad") == 0 || strcmp(what, "init") == 0) {
            v_block(block, 0, 'o');
            while (count-- > 0) {
                feed(&b, next(&e, *what == 'b' ? 0x10 : 0x1f, *what == 'b' ? 0x0001 : 0x001f, block, 0));
            }
        } else if (strcmp(what, "v") == 0) {
            while (e.at != 0) {
                idle(&b, &e, 1);
            }
            if (*second == 'i') {
                /* The CRC is over the values of the marks. */
                v_block(block, byte, 'i');
            } else {
                v_block(block, byte, *second);
            }
            for (j = 0; j < 8; j++) {
                feed(&b, next(&e, 0x10, 0x001f, block, *second == 'i' ? 0x3eu : 0));
            }
        } else if (strcmp(what, "sent") == 0) {
            for (j = 0; symbol_of(&b) == 0x10 && j < 16; j++) {
                idle(&b, &e, 1);
            }
            for (; *first != 0; first += 2) {
                say(" %02x", symbol_of(&b));
                idle(&b, &e, 1);
            }
        } else if (strcmp(what, "answer") == 0) {
            v_block(block, 0, 'o');
            for (; first != NULL && *first != 0; first += 2) {
                char symbol[3] = {first[0], first[1], 0};
                feed(&b, next(&e, (uint8_t)strtoul(symbol, NULL, 16), 0x001f, block, 0));
            }
        }
    }
}

const entry_t hdsl_link_commands[] = {
    {"hdsl_start_up", start_up}, {"hdsl_link", link_of}, {"hdsl_messages", messages}, {"hdsl_operations", operations}, {NULL, NULL},
};
