/* The binary frame of livebode for senders in C99 (docs/live.md has it byte by byte).
 *
 * Little-endian machines only. No memory is taken: the caller gives a buffer of LB_FRAME_BYTES(payload). */
#ifndef LIVEBODE_FRAME_H
#define LIVEBODE_FRAME_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define LB_FRAME_HEADER 56u
#define LB_FRAME_BYTES(payload) (LB_FRAME_HEADER + (payload) + 4u)
enum { LB_FRAME_SAMPLES = 1, LB_FRAME_LAYOUT = 2 };

/* CRC-32 of IEEE 802.3; begin with 0. */
static uint32_t lb_frame_crc(uint32_t crc, const void *bytes, size_t size) {
    const uint8_t *p = (const uint8_t *)bytes;
    crc = ~crc;
    while (size--) {
        crc ^= *p++;
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}

/* Writes one frame into `frame` and returns its length in bytes.
 *
 * layout: lb_frame_crc(0, text, length) of the layout's text, a line "name\tunit\n" for each channel.
 * payload: that text, or float32 [samples][channels]; stamp_ns: nanoseconds since 1970 UTC, 0 without a clock. */
static size_t lb_frame(uint8_t *frame, uint8_t kind, uint32_t sequence, uint64_t epoch, uint64_t sample,
                       int64_t stamp_ns, double rate_hz, uint32_t layout, uint16_t channels, uint16_t samples,
                       const void *payload, uint32_t payload_bytes) {
    const uint32_t length = (uint32_t)LB_FRAME_BYTES(payload_bytes);
    const uint8_t head[8] = {'L', 'B', 'O', 'D', 1, kind, 0, 0};
    memcpy(frame, head, 8);
    memcpy(frame + 8, &length, 4);
    memcpy(frame + 12, &sequence, 4);
    memcpy(frame + 16, &epoch, 8);
    memcpy(frame + 24, &sample, 8);
    memcpy(frame + 32, &stamp_ns, 8);
    memcpy(frame + 40, &rate_hz, 8);
    memcpy(frame + 48, &layout, 4);
    memcpy(frame + 52, &channels, 2);
    memcpy(frame + 54, &samples, 2);
    memcpy(frame + LB_FRAME_HEADER, payload, payload_bytes);
    const uint32_t crc = lb_frame_crc(0, frame, LB_FRAME_HEADER + payload_bytes);
    memcpy(frame + LB_FRAME_HEADER + payload_bytes, &crc, 4);
    return length;
}

#endif
