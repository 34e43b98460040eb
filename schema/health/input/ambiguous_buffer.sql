-- title: Ring buffers without a known subscription
-- description: The subscription that a ring buffer of intra-process messages belongs to is not
--     known.
-- cause: The session was started after the nodes, or the events of initialisation were not enabled
--     or lost.
-- cure: Start the session first, or record initialisation into a snapshot session that runs all the
--     time, and ingest both. Enable ros2:*, so that takes and executors show.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.take_chain WHERE method = 'ring_buffer' AND NOT is_known
SELECT
    count(DISTINCT (t.process_id, t.buffer_handle)) AS count,
    'ring buffers without a known subscription: their creation was not traced, and several '
    || 'callbacks got messages from one, or one callback from several, in '
    || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.take_chain AS t
JOIN staging.take_number AS n ON t.start_event_id = n.start_event_id
JOIN process_label AS l ON t.process_id = l.process_id
WHERE t.method = 'ring_buffer' AND NOT t.is_known AND n.subscription_event_id IS NULL
HAVING count(*) > 0
