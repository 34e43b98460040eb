-- description: The tracks of processes, of threads and what executors did on them, and of counters.
-- grain: one row per track
SELECT {
    'uuid': track, 'parent_uuid': parent, 'name': name, 'process': process, 'thread': thread,
    'counter': counter
} AS track_descriptor
FROM (
    SELECT
        1 AS rank, track, NULL AS parent, NULL AS name,
        {'pid': pid, 'process_name': name} AS process, NULL AS thread, NULL AS counter
    FROM perfetto_process
    UNION ALL BY NAME
    SELECT 2 AS rank, track, parent, {'pid': pid, 'tid': tid, 'thread_name': name} AS thread
    FROM perfetto_thread
    UNION ALL BY NAME
    SELECT 2 AS rank, state_track AS track, track AS parent, 'executor' AS name
    FROM perfetto_thread
    WHERE has_states
    UNION ALL BY NAME
    SELECT 3 AS rank, track, parent, name, {'unit_name': unit} AS counter
    FROM perfetto_counter
)
ORDER BY rank, track
