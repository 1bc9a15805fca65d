/* The binary frame of livebode for senders in C99 (docs/how-to/live.md has it byte by byte): samples with lb_frame, or
 * spectra of a drive that runs the kernel with lb_frame_put_spectrum and lb_frame_spectra.
 *
 * Little-endian machines only. No memory is taken: the caller gives a buffer of LB_FRAME_BYTES(payload). */
#ifndef LIVEBODE_FRAME_H
#define LIVEBODE_FRAME_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define LB_FRAME_HEADER 56u
#define LB_FRAME_BYTES(payload) (LB_FRAME_HEADER + (payload) + 4u)
/* Payload of `count` spectra in one frame, float32. */
#define LB_FRAME_SPECTRA_PAYLOAD(signals, bins, values, count) \
    ((uint32_t)(count) * (4u + 4u * ((uint32_t)(values) + 2u * (uint32_t)(signals) * (uint32_t)(bins))))
enum { LB_FRAME_SAMPLES = 1, LB_FRAME_LAYOUT = 2, LB_FRAME_SPECTRA = 3, LB_FRAME_SPECTRA_LAYOUT = 4 };
/* State of a window: it holds a start, a gap or a sample that is not finite; it holds a spike. 0: a good one. */
enum { LB_FRAME_NOT_WHOLE = 1, LB_FRAME_SPIKE = 2 };

/* CRC-32 of IEEE 802.3; begin with 0. */
static inline uint32_t lb_frame_crc(uint32_t crc, const void *bytes, size_t size)
{
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
 * payload: that text, or float32 [samples][channels]; stamp_ns: nanoseconds since 1970 UTC, 0 without a clock.
 * The payload may already lie at frame + LB_FRAME_HEADER. */
static inline size_t lb_frame(uint8_t *frame, uint8_t kind, uint32_t sequence, uint64_t epoch, uint64_t sample,
                              int64_t stamp_ns, double rate_hz, uint32_t layout, uint16_t channels, uint16_t samples,
                              const void *payload, uint32_t payload_bytes)
{
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
    memmove(frame + LB_FRAME_HEADER, payload, payload_bytes);
    const uint32_t crc = lb_frame_crc(0, frame, LB_FRAME_HEADER + payload_bytes);
    memcpy(frame + LB_FRAME_HEADER + payload_bytes, &crc, 4);
    return length;
}

/* Puts one spectrum into the payload of `frame`, as number `index` (0, 1, …) of those in it.
 *
 * values[values_count]: the plain values at the window's centre. sums[signals][bins][2]: as lb_sdft32_read gives them
 * with LB_PHASE_FIXED, bins in the order of the layout (the lines, then the quiet ones). */
static inline void lb_frame_put_spectrum(uint8_t *frame, uint16_t index, uint32_t state, const float *values,
                                         uint16_t values_count, const float *sums, uint16_t signals, uint16_t bins)
{
    uint8_t *at = frame + LB_FRAME_HEADER + LB_FRAME_SPECTRA_PAYLOAD(signals, bins, values_count, index);
    memcpy(at, &state, 4);
    if (values_count) {
        memcpy(at + 4, values, 4u * (size_t)values_count);
    }
    memcpy(at + 4 + 4u * (size_t)values_count, sums, 8u * (size_t)signals * bins);
}

/* Completes a frame into which `count` spectra were put, each a hop after the one before; returns its length.
 *
 * layout: lb_frame_crc(0, text, length) of the text that docs/how-to/live.md describes, itself sent with lb_frame as
 * LB_FRAME_SPECTRA_LAYOUT of signals + values_count channels and 0 samples. sample, stamp_ns: of the newest sample in
 * the first spectrum's window; sample + 1 is a multiple of the hop. */
static inline size_t lb_frame_spectra(uint8_t *frame, uint32_t sequence, uint64_t epoch, uint64_t sample,
                                      int64_t stamp_ns, double rate_hz, uint32_t layout, uint16_t signals,
                                      uint16_t bins, uint16_t values_count, uint16_t count)
{
    return lb_frame(frame, LB_FRAME_SPECTRA, sequence, epoch, sample, stamp_ns, rate_hz, layout,
                    (uint16_t)(signals + values_count), count, frame + LB_FRAME_HEADER,
                    LB_FRAME_SPECTRA_PAYLOAD(signals, bins, values_count, count));
}

#endif
