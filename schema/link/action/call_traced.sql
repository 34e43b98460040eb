-- description: Processes whose requests and responses have events in a trace of their host. Where
--     none was seen, there was none.
-- grain: one row per such process
SELECT process_id
FROM store.process
WHERE host_id IN (SELECT host_id FROM store.trace WHERE has_request_events)
