-- title: From when on something matters
-- description: Limits that an engineer would notice. A healthy robot stays below all of them.
-- grain: one row
-- column: late_ns BIGINT [ns]  Delay of a message: one period of a controller of 50 Hz
-- column: least_ns BIGINT [ns]  The same, of what comes more often: less is noise
-- column: of_period DOUBLE  Share of the period of a callback: more leaves no time for others
-- column: of_path DOUBLE  Share of the latency of a path: less changes little
-- column: of_callback DOUBLE  Share of the time of a callback: what takes less is no reason for it
-- column: nearly_all DOUBLE  Share of what happens each time: the rest has other reasons
-- column: lost BIGINT  Messages lost: fewer are chance
-- column: of_messages DOUBLE  Share of the messages of a topic that are lost
-- column: load DOUBLE  Share of its time that a thread is asked for: above it queues grow
-- column: start_ns BIGINT [ns]  How much later than the others a node begins: robots take seconds
-- column: of_recording DOUBLE  The same as a share of a long recording
SELECT
    20_000_000::BIGINT AS late_ns,
    1_000_000::BIGINT AS least_ns,
    0.8::DOUBLE AS of_period,
    0.1::DOUBLE AS of_path,
    0.3::DOUBLE AS of_callback,
    0.95::DOUBLE AS nearly_all,
    3::BIGINT AS lost,
    0.02::DOUBLE AS of_messages,
    0.9::DOUBLE AS load,
    2_000_000_000::BIGINT AS start_ns,
    0.02::DOUBLE AS of_recording
