-- name: critical-path
-- title: What one flow waited for
-- description: The flow that took longest, or the longest that ends with a given take (see the
--     query flows), piece by piece. Waits are replaced by what they waited for, as far as the trace
--     shows: what the executor ran meanwhile, the timer that was not due yet, or the message that
--     was still missing and how that came about. The pieces add up to the latency exactly.
-- grain: one row per piece of the flow
-- param: from VARCHAR = NULL       Topic where flows start; every source when NULL
-- param: to VARCHAR = NULL         Topic where flows end; wherever they end when NULL
-- param: take_id BIGINT = NULL     Take at the end of the flow; any when NULL
-- param: from_event VARCHAR {callback_start|publish} = 'callback_start'  Event that starts
--     the clock
-- param: to_event VARCHAR {take|callback_start|callback_end} = 'callback_end'  Event that
--     stops it
-- param: max_depth BIGINT {1..} = 32     Longest path, in topics
-- param: max_paths BIGINT {1..} = 1000   Most paths, shortest first, and most chains per length
-- column: run_id BIGINT            Run
-- column: at_ns BIGINT [ns]        Begin, since the start of the flow
-- column: duration_ns BIGINT [ns]  Duration; negative where parts of the flow overlap
-- column: hop BIGINT               Which message of the path it is, or leads to
-- column: part VARCHAR             Part of the flow: 'callback', 'cache', 'request_to_take',
--     'service', 'publish' or its layer, 'publish_to_take' or 'take_to_callback'
-- column: activity VARCHAR         What happened: the part itself; up to a take 'network_or_idle',
--     'executor_busy' (it ran something else), 'blocked' (a callback ran that excludes the waiting
--     one) or 'undecided' (nothing tells when the message arrived); in a cache 'timer' (not due
--     yet), 'unpublished' (the message that was waited for had not been published), or a part of
--     the way of that message
-- column: node VARCHAR             Node that did it, or that waited
-- column: what VARCHAR             The callback, or the topic of the message
-- column: share DOUBLE             Part of the latency, rounded to 4 places
-- column: is_certain BOOLEAN       Of 'executor_busy' and 'blocked': what waited was ready by then;
--     no: it may have arrived during this piece
-- column: from_ns BIGINT [epoch ns]  Begin
-- column: callback_instance_id BIGINT  Callback instance
-- column: publication_id BIGINT    Message
-- column: take_id BIGINT           Take at the end of the flow
-- column: latency_ns BIGINT [ns]   Latency of the whole flow
-- note: clocks
-- needs: main.critical_path, main.callback_instance, main.callback_label, main.publication,
--     main.publisher, main.node, main.process
SELECT
    c.run_id,
    c.from_ns - min(CASE WHEN c.position = 1 THEN c.from_ns END) OVER () AS at_ns,
    c.duration_ns,
    c.hop,
    c.part,
    c.activity,
    coalesce(
        l.node, n.full_name, printf('[%s %d]', coalesce(r.name, '?'), r.pid)
    ) AS node,
    CASE
        WHEN c.activity IN (
            'callback', 'cache', 'take_to_callback', 'service', 'executor_busy', 'blocked', 'timer'
        ) OR c.part = 'request_to_take' THEN l.label
        ELSE coalesce(p.topic_name, '?')
    END AS what,
    round(c.duration_ns / nullif(c.latency_ns, 0), 4) AS share,
    c.is_certain,
    c.from_ns,
    c.callback_instance_id,
    c.publication_id,
    c.take_id,
    c.latency_ns
FROM main.critical_path(
    $runs, $from, $to, $from_event, $to_event, $start_ns, $end_ns,
    sink_take_id := $take_id, max_depth := $max_depth, max_paths := $max_paths
) AS c
LEFT JOIN main.callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
LEFT JOIN main.callback_label AS l ON i.callback_id = l.callback_id
LEFT JOIN main.publication AS b ON c.publication_id = b.publication_id
LEFT JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
LEFT JOIN main.process AS r ON b.process_id = r.process_id
LEFT JOIN main.node AS n ON p.node_id = n.node_id
ORDER BY c.position
