/* What reading a trace spends most of its time on. msgflow.kernel loads it where it was compiled;
 * all of it exists in Python and numpy as well, which take over where this gives up.
 *
 * Nothing in a trace is trusted: every read of packets is checked against the end of their memory,
 * and every size against what is left. Arrays and tables come from Python, which made them large
 * enough. Nothing here allocates, keeps state or calls Python. For little-endian machines. */

#include <stdint.h>
#include <string.h>

/* What it was compiled from, so that it is never used with another version of msgflow. */
const uint32_t msgflow_source = MSGFLOW_SOURCE;

#define RESIDUES 8
#define LENGTHS 16
#define NO_FORM 255

/* An integer of an event header, see Place in event_header.py. */
typedef struct {
    int64_t width, is_big_endian, shift;
    uint64_t mask;
    int64_t offsets[RESIDUES];
} Place;

/* A form of the event header; `time_mask` is 0 where it has no time stamp. */
typedef struct {
    int64_t has_id;
    uint64_t time_mask;
    Place id, time;
    int64_t sizes[RESIDUES];
} Form;

enum { SKIP, NUMBER, STRING, SEQUENCE };

/* A step through a body whose size varies: `size` bytes for SKIP and NUMBER, for SEQUENCE of each
 * element. NUMBER keeps a length in `slot`, SEQUENCE takes it from there. */
typedef struct {
    int64_t align, size, kind, slot, is_big_endian;
} Step;

/* The contexts and payload of an event class: `step_count` is 0 where sizes are known. */
typedef struct {
    int64_t number, first_step, step_count;
    int64_t sizes[RESIDUES];
} Body;

/* A stream class. `body_of`: event id to its body, -1 for none. `form_of`: selector to form. */
typedef struct {
    int64_t residues, align, selector_count, id_count;
    uint64_t only_id;
    Place selector;
    const Form *forms;
    const uint8_t *form_of;
    const Body *bodies;
    const int32_t *body_of;
    const Step *steps;
} Layout;

/* Bytes, and how many of them. */
typedef struct {
    const uint8_t *data;
    int64_t size;
} Memory;

static uint64_t load(const uint8_t *from, int64_t width, int64_t is_big_endian)
{
    uint8_t byte;
    uint16_t two;
    uint32_t four;
    uint64_t eight;
    switch (width) {
    case 1:
        memcpy(&byte, from, 1);
        return byte;
    case 2:
        memcpy(&two, from, 2);
        return is_big_endian ? __builtin_bswap16(two) : two;
    case 4:
        memcpy(&four, from, 4);
        return is_big_endian ? __builtin_bswap32(four) : four;
    default:
        memcpy(&eight, from, 8);
        return is_big_endian ? __builtin_bswap64(eight) : eight;
    }
}

static int64_t aligned(int64_t position, int64_t align)
{
    return (position + align - 1) & -align;
}

/* Read an integer of the header at `position`; return 0 where memory ends before. */
static int read_place(const Memory *memory, const Place *place, int64_t position, int64_t residue,
                      uint64_t *value)
{
    int64_t at = position + place->offsets[residue];
    if (at < 0 || at > memory->size - place->width)
        return 0;
    *value = load(memory->data + at, place->width, place->is_big_endian) >> place->shift
             & place->mask;
    return 1;
}

/* Find form and body of the event at `position`; return 0 if there is none. */
static int read_header(const Layout *layout, const Memory *memory, int64_t position,
                       const Form **form, const Body **body)
{
    int64_t residue = position & (layout->residues - 1);
    uint64_t selector, id;
    if (!read_place(memory, &layout->selector, position, residue, &selector)
        || selector >= (uint64_t)layout->selector_count || layout->form_of[selector] == NO_FORM)
        return 0;
    *form = layout->forms + layout->form_of[selector];
    id = layout->only_id;
    if ((*form)->has_id && !read_place(memory, &(*form)->id, position, residue, &id))
        return 0;
    if (id >= (uint64_t)layout->id_count || layout->body_of[id] < 0)
        return 0;
    *body = layout->bodies + layout->body_of[id];
    return 1;
}

/* Return where a body of varying size ends, -1 if that is not before `limit`. */
static int64_t walk(const Layout *layout, const Memory *memory, const Body *body, int64_t at,
                    int64_t limit)
{
    uint64_t lengths[LENGTHS] = {0};
    const Step *step = layout->steps + body->first_step;
    const Step *end = step + body->step_count;
    for (; step < end; step++) {
        const uint8_t *nul;
        at = aligned(at, step->align);
        if (at > limit)
            return -1;
        switch (step->kind) {
        case STRING:
            nul = memchr(memory->data + at, 0, (size_t)(limit - at));
            if (nul == NULL)
                return -1;
            at = nul - memory->data + 1;
            break;
        case SEQUENCE:
            if (step->size > 0 && lengths[step->slot] > (uint64_t)((limit - at) / step->size))
                return -1;
            at += (int64_t)lengths[step->slot] * step->size;
            break;
        default:
            if (step->size > limit - at)
                return -1;
            if (step->kind == NUMBER)
                lengths[step->slot] = load(memory->data + at, step->size, step->is_big_endian);
            at += step->size;
        }
    }
    return at;
}

/* Find the events of a packet from `*position` on, whose content ends before `limit` and after
 * which a header would begin at `until`.
 *
 * Return how many were found, at most `room`; `*position` is where the next one begins. Where that
 * is before `until` although there is room, no event of this layout begins there. */
int64_t msgflow_scan(const Layout *layout, const uint8_t *data, int64_t size, int64_t limit,
                     int64_t until, int64_t *position, int64_t *found, int64_t room)
{
    Memory memory = {data, size};
    int64_t at = *position, count = 0;
    if (at < 0 || limit > size)
        return 0;
    while (at < until && count < room) {
        const Form *form;
        const Body *body;
        int64_t begin, end;
        if (!read_header(layout, &memory, at, &form, &body))
            break;
        begin = at + form->sizes[at & (layout->residues - 1)];
        if (begin > limit)
            break;
        if (body->step_count)
            end = walk(layout, &memory, body, begin, limit);
        else
            end = begin + body->sizes[begin & (layout->residues - 1)];
        if (end > limit || end <= at)
            break;
        found[count++] = at;
        at = aligned(end, layout->align);
    }
    *position = at;
    return count;
}

/* Read the headers of events found before: class, clock and where the body begins.
 *
 * `clock` is the value before the first. Return how many could be read. */
int64_t msgflow_headers(const Layout *layout, const uint8_t *data, int64_t size,
                        const int64_t *positions, int64_t count, uint64_t clock,
                        uint32_t *classes, uint64_t *clocks, int64_t *bodies)
{
    Memory memory = {data, size};
    int64_t row;
    for (row = 0; row < count; row++) {
        int64_t at = positions[row], residue = at & (layout->residues - 1);
        const Form *form;
        const Body *body;
        uint64_t time;
        if (at < 0 || !read_header(layout, &memory, at, &form, &body))
            break;
        if (form->time_mask) {
            if (!read_place(&memory, &form->time, at, residue, &time))
                break;
            clock += (time - clock) & form->time_mask;
        }
        classes[row] = (uint32_t)body->number;
        clocks[row] = clock;
        bodies[row] = at + form->sizes[residue];
    }
    return row;
}

/* Order rows by class, those of a class as they come.
 *
 * `ends` has a zero for each class, and gets the end of each in `rows`. Return how many rows were
 * ordered: fewer than `count`, and `rows` means nothing, if a class is not below `class_count`. */
int64_t msgflow_split(const uint32_t *classes, int64_t count, int64_t class_count, int64_t *ends,
                      int64_t *rows)
{
    int64_t row, number, begin = 0;
    for (row = 0; row < count; row++) {
        if (classes[row] >= class_count)
            return row;
        ends[classes[row]]++;
    }
    for (number = 0; number < class_count; number++) {
        int64_t of_class = ends[number];
        ends[number] = begin;
        begin += of_class;
    }
    for (row = 0; row < count; row++)
        rows[ends[classes[row]]++] = row;
    return count;
}

/* Numbers that lie at `offsets` from the begin of a body, by its residue. `out` has integers of
 * `out_width` bytes; those that do not fit wrap round. */
typedef struct {
    int64_t width, is_big_endian, is_signed, out_width;
    int64_t offsets[RESIDUES];
    void *out;
} Column;

/* Columns are filled for so many rows at a time: what lies near them stays in the cache. */
#define ROWS_AT_ONCE 256

static int fill(const Memory *memory, const Column *column, const int64_t *bodies, int64_t residues,
                int64_t begin, int64_t end)
{
    int64_t row, unused = 64 - 8 * column->width;
    for (row = begin; row < end; row++) {
        int64_t at = bodies[row] + column->offsets[bodies[row] & (residues - 1)];
        uint64_t value;
        if (bodies[row] < 0 || at > memory->size - column->width)
            return 0;
        value = load(memory->data + at, column->width, column->is_big_endian);
        if (column->is_signed)
            value = (uint64_t)((int64_t)(value << unused) >> unused);
        switch (column->out_width) {
        case 1:
            ((uint8_t *)column->out)[row] = (uint8_t)value;
            break;
        case 2:
            ((uint16_t *)column->out)[row] = (uint16_t)value;
            break;
        case 4:
            ((uint32_t *)column->out)[row] = (uint32_t)value;
            break;
        default:
            ((uint64_t *)column->out)[row] = value;
        }
    }
    return 1;
}

/* Texts of `length` bytes, numbered as they are first seen.
 *
 * `known` has room for `room` of them, of which `count` are there; `slots` has a power of two of
 * places, more than `room`, which are -1 where they are free. `offset` is from the begin of a body,
 * by its residue. */
typedef struct {
    int64_t length, room, count, slot_count;
    int64_t offsets[RESIDUES];
    uint8_t *known;
    int32_t *slots;
    int32_t *out;
} Texts;

/* Number texts; return 0 where one is not in memory, or there is no room for it. */
static int number(const Memory *memory, Texts *texts, const int64_t *bodies, int64_t residues,
                  int64_t begin, int64_t end)
{
    int64_t row, length = texts->length;
    for (row = begin; row < end; row++) {
        int64_t place = bodies[row] + texts->offsets[bodies[row] & (residues - 1)];
        const uint8_t *text = memory->data + place;
        uint64_t hash = 0, word;
        int64_t at, slot;
        if (bodies[row] < 0 || place > memory->size - length)
            return 0;
        for (at = 0; at + 8 <= length; at += 8) {
            memcpy(&word, text + at, 8);
            hash = (hash ^ word) * 0x9E3779B97F4A7C15u;
        }
        for (; at < length; at++)
            hash = (hash ^ text[at]) * 0x9E3779B97F4A7C15u;
        slot = (int64_t)(hash >> 33) & (texts->slot_count - 1);
        while (texts->slots[slot] >= 0
               && memcmp(texts->known + texts->slots[slot] * length, text, (size_t)length) != 0)
            slot = (slot + 1) & (texts->slot_count - 1);
        if (texts->slots[slot] < 0) {
            if (texts->count >= texts->room)
                return 0;
            memcpy(texts->known + texts->count * length, text, (size_t)length);
            texts->slots[slot] = (int32_t)texts->count++;
        }
        texts->out[row] = texts->slots[slot];
    }
    return 1;
}

/* Gather numbers, and texts unless that is NULL, of events of one class.
 *
 * Return how many events: fewer where one is not in memory, or there is no room for a text. */
int64_t msgflow_gather(const uint8_t *data, int64_t size, int64_t residues, const int64_t *bodies,
                       int64_t count, const Column *columns, int64_t column_count, Texts *texts)
{
    Memory memory = {data, size};
    int64_t begin, column, row;
    for (begin = 0; begin < count; begin += ROWS_AT_ONCE) {
        int64_t end = count - begin < ROWS_AT_ONCE ? count : begin + ROWS_AT_ONCE;
        for (row = begin; row < end; row++)
            if (bodies[row] >= 0 && bodies[row] < size)
                __builtin_prefetch(data + bodies[row]);
        for (column = 0; column < column_count; column++)
            if (!fill(&memory, columns + column, bodies, residues, begin, end))
                return begin;
        if (texts && !number(&memory, texts, bodies, residues, begin, end))
            return begin;
    }
    return count;
}

/* Number values as they are first seen.
 *
 * `known` has room for `room` of them, of which `*known_count` are there; `slots` has a power of two
 * of places, more than `room`, which are -1 where they are free. Return how many were numbered:
 * there is no room for the next one. */
int64_t msgflow_numbers(const int64_t *values, int64_t count, int64_t *known, int64_t room,
                        int64_t *known_count, int32_t *slots, int64_t slot_count, int32_t *numbers)
{
    int64_t row;
    for (row = 0; row < count; row++) {
        uint64_t hash = (uint64_t)values[row] * 0x9E3779B97F4A7C15u;
        int64_t slot = (int64_t)(hash >> 32) & (slot_count - 1);
        while (slots[slot] >= 0 && known[slots[slot]] != values[row])
            slot = (slot + 1) & (slot_count - 1);
        if (slots[slot] < 0) {
            if (*known_count >= room)
                break;
            known[*known_count] = values[row];
            slots[slot] = (int32_t)(*known_count)++;
        }
        numbers[row] = slots[slot];
    }
    return row;
}

enum { EVENT_ID, TS_NS, LABEL, ORIGINS };

/* What is wanted of the latest event of a sequence on the same thread: labels are of one byte. */
typedef struct {
    int64_t sequence, origin;
    void *out;
} Wanted;

/* Events of one tracepoint in order of their ids; `sequences` has a bit for each it belongs to. */
typedef struct {
    const int64_t *ids, *times;
    const int32_t *threads, *names;
    int64_t count, sequences, label;
    const Wanted *wanted;
    int64_t wanted_count;
} Events;

/* A stretch of events of a thread under one name: rows of these, in the order of their begins. */
typedef struct {
    int64_t thread, name, first_id, last_id, first_time, last_time;
} Stretch;

/* Go through the events of all batches in order of their ids, which lie in `id_count` from
 * `first_id` on.
 *
 * `owners` has a zero for each id. `latest` has the origins of the latest event by thread and
 * sequence, -1 for none, and is brought up to date. `stretch_of` has -1 for each thread;
 * `stretches` has room for as many as there are events. Return how many stretches there are, -1 if
 * ids or threads are not as they should be. */
int64_t msgflow_place(const Events *batches, int64_t batch_count, int64_t first_id,
                      int64_t id_count, int32_t *owners, int64_t *next, int64_t thread_count,
                      int64_t sequence_count, int64_t *latest, int64_t *stretch_of,
                      Stretch *stretches)
{
    int64_t batch, id, stretch_count = 0;
    for (batch = 0; batch < batch_count; batch++) {
        int64_t row;
        for (row = 0; row < batches[batch].count; row++) {
            int64_t place = batches[batch].ids[row] - first_id;
            int64_t thread = batches[batch].threads[row];
            if (place < 0 || place >= id_count || thread < 0 || thread >= thread_count)
                return -1;
            owners[place] = (int32_t)batch + 1;
        }
    }
    for (id = 0; id < id_count; id++) {
        const Events *events = batches + owners[id] - 1;
        const Wanted *wanted;
        int64_t row, thread, sequence, *of_thread, *stretch;
        if (owners[id] == 0)
            continue;
        row = next[owners[id] - 1]++;
        if (row >= events->count || events->ids[row] != first_id + id)
            return -1;
        thread = events->threads[row];
        of_thread = latest + thread * sequence_count * ORIGINS;
        for (wanted = events->wanted; wanted < events->wanted + events->wanted_count; wanted++) {
            int64_t value = of_thread[wanted->sequence * ORIGINS + wanted->origin];
            if (wanted->origin == LABEL)
                ((int8_t *)wanted->out)[row] = (int8_t)value;
            else
                ((int64_t *)wanted->out)[row] = value;
        }
        for (sequence = 0; sequence < sequence_count; sequence++)
            if (events->sequences >> sequence & 1) {
                of_thread[sequence * ORIGINS + EVENT_ID] = first_id + id;
                of_thread[sequence * ORIGINS + TS_NS] = events->times[row];
                of_thread[sequence * ORIGINS + LABEL] = events->label;
            }
        stretch = stretch_of + thread;
        if (*stretch < 0 || stretches[*stretch].name != events->names[row]) {
            *stretch = stretch_count++;
            stretches[*stretch] = (Stretch){.thread = thread,
                                            .name = events->names[row],
                                            .first_id = first_id + id,
                                            .first_time = events->times[row]};
        }
        stretches[*stretch].last_id = first_id + id;
        stretches[*stretch].last_time = events->times[row];
    }
    return stretch_count;
}
