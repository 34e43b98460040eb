-- What an ingest reads, besides the events: these have a table of `raw` for each tracepoint, as
-- `msgflow/ingest/tracepoints.toml` says. Then `schema/alignment`, `model`, `kernel` and `arrival`
-- add theirs.

-- Packets, as the reader has them.
CREATE TABLE raw.packet (trace_index INTEGER, stream_index INTEGER, stream_class_id BIGINT,
    stream_instance_id BIGINT, cpu_id INTEGER, position BIGINT, begin_ns BIGINT, end_ns BIGINT,
    last_event_ns BIGINT, event_count BIGINT, discarded_event_count BIGINT,
    lost_packet_count BIGINT, is_numbered BOOLEAN);
-- Threads, and stretches of their events under one name.
CREATE TABLE raw.thread (thread_index INTEGER, trace_index INTEGER, pid_ns BIGINT, vpid INTEGER,
    vtid INTEGER);
CREATE TABLE raw.thread_name (thread_index INTEGER, procname VARCHAR, first_event_id BIGINT,
    last_event_id BIGINT, first_seen_ns BIGINT, last_seen_ns BIGINT);
-- Events of threads that changed their CPU twice faster than a thread can.
CREATE TABLE raw.cpu_return (thread_index INTEGER, event_id BIGINT);
-- What performance counters of a thread had counted at an event of a callback.
CREATE TABLE raw.reading (event_id BIGINT, ts_ns BIGINT, trace_index INTEGER, cpu_id INTEGER,
    thread_index INTEGER, event VARCHAR, callback UBIGINT, counter VARCHAR, value BIGINT);
-- Traces that have nothing but such readings: their events are in other traces.
CREATE TABLE staging.reader (trace_index INTEGER);
-- Interrupts, each with the thread that it interrupted.
CREATE TABLE raw.interrupt (trace_index INTEGER, kind ENUM('interrupt', 'softirq', 'timer'),
    start_ns BIGINT, end_ns BIGINT, tid INTEGER);
-- Lines of `perf script`.
CREATE TABLE raw.stack_sample (hostname VARCHAR, is_monotonic BOOLEAN, head VARCHAR,
    stack VARCHAR);
-- Lines of samples of the system, with the host that they are of. The first of a file has the
-- number 0, and says what is true of all.
CREATE TABLE raw.usage (file INTEGER, hostname VARCHAR, number BIGINT, line VARCHAR);
-- What could not be read of such files.
CREATE TABLE staging.usage_damage (file VARCHAR, message VARCHAR);
-- The traces.
CREATE TABLE staging.source (trace_index INTEGER, path VARCHAR, uuid VARCHAR, domain VARCHAR,
    hostname VARCHAR, tracer VARCHAR, clock_uuid VARCHAR, clock_key VARCHAR, begin_ns BIGINT,
    end_ns BIGINT, clock_correction_ns BIGINT, clock_origin_ns BIGINT);
CREATE TABLE staging.event_count (trace_index INTEGER, name VARCHAR, is_known BOOLEAN,
    event_count BIGINT);
-- Tracepoints that were enabled in a trace, also if they never occurred.
CREATE TABLE staging.declared (trace_index INTEGER, name VARCHAR);
-- Events that another trace holds as well.
CREATE TABLE staging.left_out (trace_index INTEGER, used_index INTEGER, event_count BIGINT,
    thread_count BIGINT, length_ns BIGINT);
-- Patterns of events to leave out, and of the user's events to load, with the events that match;
-- NULL: none does.
CREATE TABLE staging.ignored (place INTEGER, pattern VARCHAR, event VARCHAR);
CREATE TABLE staging.asked (place INTEGER, pattern VARCHAR, event VARCHAR);
-- Packets that a trace holds twice, or where it is NULL several traces.
CREATE TABLE staging.packet_read_once (trace_index INTEGER, packet_count BIGINT);
-- Values that were left out.
CREATE TABLE staging.implausible (event VARCHAR, field VARCHAR, what VARCHAR, value_count BIGINT);
CREATE TABLE staging.damage (trace_index INTEGER, file VARCHAR, position BIGINT,
    byte_offset BIGINT, message VARCHAR);
