-- title: A word is not of the vocabulary
-- description: Kinds, methods, states, reasons and names of findings are words of the vocabulary.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per word that is not
-- severity: error
WITH foreign_word AS (
    SELECT DISTINCT
        run_id,
        'gap.kind' AS place,
        kind AS word
    FROM store.gap
    WHERE kind NOT IN ('loss', 'packets', 'pause')
    UNION ALL
    SELECT run_id, 'run.clock_sync', clock_sync
    FROM store.run
    WHERE clock_sync NOT IN ('none', 'messages', 'file')
    UNION ALL
    SELECT DISTINCT run_id, 'clock.method', method
    FROM store.clock
    WHERE method NOT IN ('none', 'messages', 'packets', 'file')
    UNION ALL
    SELECT DISTINCT run_id, 'callback.kind', kind
    FROM store.callback
    WHERE kind NOT IN ('subscription', 'timer', 'service', 'action', 'function', 'unknown')
    UNION ALL
    SELECT DISTINCT run_id, 'annotation.kind', kind
    FROM store.annotation
    WHERE kind NOT IN (
        'periodic_async', 'partial_sync', 'approximate_sync', 'queue', 'direct', 'independent'
    )
    UNION ALL
    SELECT DISTINCT run_id, 'annotation.source', source
    FROM store.annotation
    WHERE source NOT IN ('trace', 'file')
    UNION ALL
    SELECT DISTINCT run_id, 'take.method', method
    FROM store.take
    WHERE method NOT IN ('rmw', 'ring_buffer', 'agnocast', 'caret', 'callback_only')
    UNION ALL
    SELECT DISTINCT run_id, 'executor_state.state', state
    FROM store.executor_state
    WHERE state NOT IN ('wait', 'process', 'execute')
    UNION ALL
    SELECT DISTINCT run_id, 'thread_state.state', state
    FROM store.thread_state
    WHERE state NOT IN (
        'running', 'preempted', 'runnable', 'sleeping', 'uninterruptible', 'unknown'
    )
    UNION ALL
    SELECT DISTINCT run_id, 'thread_state.waker_kind', waker_kind
    FROM store.thread_state
    WHERE waker_kind NOT IN ('thread', 'timer', 'interrupt', 'softirq')
    UNION ALL
    SELECT DISTINCT run_id, 'ring_buffer_event.kind', kind
    FROM store.ring_buffer_event
    WHERE kind NOT IN ('enqueue', 'dequeue', 'clear')
    UNION ALL
    SELECT DISTINCT run_id, 'link_transport.method', method
    FROM store.link_transport
    WHERE method NOT IN ('exact', 'exact_stamp', 'nearest', 'ring_buffer', 'agnocast')
    UNION ALL
    SELECT DISTINCT run_id, 'link_causal.kind', kind
    FROM store.link_causal
    WHERE kind NOT IN (
        'direct', 'periodic_async', 'partial_sync', 'approximate_sync', 'queue', 'take_adjacent',
        'polled'
    )
    UNION ALL
    SELECT DISTINCT run_id, 'undelivered.reason', reason
    FROM store.undelivered
    WHERE reason NOT IN (
        'before_subscription', 'subscription_ended', 'reader_in_callback', 'receiver_gap',
        'never_taken', 'before_discovery', 'no_longer_taken', 'take_failed', 'not_delivered',
        'overwritten', 'lost_in_transport', 'pending_at_end', 'unknown'
    )
    UNION ALL
    SELECT DISTINCT run_id, 'orphan_take.reason', reason
    FROM store.orphan_take
    WHERE reason NOT IN (
        'no_stamp', 'receiver_gap', 'clock_set', 'before_tracing', 'publisher_gap',
        'publisher_without_events', 'publisher_trace_ends', 'publisher_not_traced', 'ambiguous',
        'unknown'
    )
    UNION ALL
    SELECT DISTINCT run_id, 'finding.name', name
    FROM store.finding
    WHERE name NOT IN (SELECT name FROM derive.finding_kind)
)
SELECT
    run_id,
    place AS subject,
    1 AS count,
    printf('the word %s', word) AS detail
FROM foreign_word
