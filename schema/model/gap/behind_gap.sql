-- name: staging.behind_gap
-- kind: inline
-- description: Events that are not paired with their predecessor in a sequence of their thread, as
--     a gap may hide one between them: a loss on the CPU of either, or a pause of the trace; for
--     what executors say of themselves, a loss on any CPU. Nothing else tells that a state lasted,
--     while a callback that begins and ends is most likely one instance, and marked.
-- grain: one row per event and sequence that a gap interrupts
SELECT event_id, thread_index, sequence
FROM staging.near_gap
WHERE is_between OR sequence = 'executor'
