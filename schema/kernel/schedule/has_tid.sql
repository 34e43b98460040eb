-- description: Whether a number of the kernel meant a thread at a moment. `known` is a row of
--     staging.thread_tid.
CREATE OR REPLACE MACRO staging.has_tid(known, clock_key, tid, at_ns) AS
known.clock_key = clock_key AND known.tid = tid
AND at_ns >= known.from_ns AND at_ns < known.until_ns
