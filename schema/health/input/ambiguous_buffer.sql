-- title: Ring buffers without a known subscription
-- description: The subscription that a ring buffer of intra-process messages belongs to is not
--     known.
-- cause: The session was started after the nodes, or the events of initialisation were not enabled
--     or lost.
-- cure: Start the session first, or record initialisation into a snapshot session that runs all the
--     time, and ingest both. Enable ros2:*, so that takes and executors show.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.buffer_owner
SELECT
    count(*) AS count,
    'ring buffers without a known subscription: their creation was not traced, and several '
    || 'callbacks got messages from one, or one callback from several, in '
    || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.buffer_owner AS o
JOIN process_label AS l ON o.process_id = l.process_id
WHERE o.subscription_event_id IS NULL
HAVING count(*) > 0
