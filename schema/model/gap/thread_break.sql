-- description: Where the record of a thread breaks: the first of all its events behind each gap, a
--     loss on the CPU of that event or the one before, or a pause of the trace; or, where
--     `is_elsewhere`, a loss on other CPUs only, which the thread may have visited meanwhile.
-- grain: one row per event with a gap between itself and the one before on its thread
-- when: staging.near_gap
SELECT
    g.thread_id,
    g.event_id AS resumed_event_id,
    g.ts_ns AS resumed_ns,
    NOT g.is_between AS is_elsewhere
FROM staging.near_gap AS g
JOIN staging.thread AS t ON g.thread_id = t.thread_id AND g.event_id > t.first_event_id
WHERE g.sequence = 'thread'
