"""What a Perfetto trace has, as rows: tracks, names, slices with the links between them, counters.

Identities in the file are those of the database, eight to an object: `* 8 + code`.
"""

from __future__ import annotations

# Two processes (of two hosts, or lives) may have one pid; Perfetto would take them for one.
PROCESSES = """
SELECT
    p.process_id * 8 + 1 AS track,
    CASE WHEN count(*) OVER (PARTITION BY p.pid) = 1 THEN p.pid
        ELSE 1000000000 + row_number() OVER (ORDER BY p.process_id) END AS pid,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS name
FROM main.process AS p
JOIN main.host AS h ON p.host_id = h.host_id
WHERE p.run_id = $run
ORDER BY track
"""

THREADS = f"""
WITH process AS ({PROCESSES})
SELECT
    t.thread_id * 8 + 2 AS track,
    p.track AS parent,
    p.pid,
    CASE WHEN count(*) OVER (PARTITION BY t.tid) = 1 THEN t.tid
        ELSE 1500000000 + row_number() OVER (ORDER BY t.thread_id) END AS tid,
    printf('%s %d', coalesce(t.name, '?'), t.tid) AS name,
    t.thread_id IN (
        SELECT thread_id FROM main.executor_state WHERE run_id = $run
    ) AS has_states,
    t.thread_id * 8 + 3 AS state_track
FROM main.thread AS t
JOIN process AS p ON t.process_id * 8 + 1 = p.track
WHERE t.run_id = $run
ORDER BY track
"""

COUNTERS = """
SELECT publisher_id * 8 + 4 AS track, process_id * 8 + 1 AS parent,
    'rate of ' || coalesce(topic_name, '?') AS name, 'Hz' AS unit
FROM main.publisher
WHERE run_id = $run
UNION ALL
SELECT subscription_id * 8 + 5, process_id * 8 + 1,
    'not yet taken of ' || coalesce(topic_name, '?'), 'messages'
FROM main.subscription
WHERE run_id = $run
ORDER BY track
"""

# Names that slices refer to by number; with 0 those of what is not known.
NAMES = """
SELECT 0 AS code, callback_id AS id, node || ' ' || label AS name
FROM main.callback_label
WHERE run_id = $run
UNION ALL
SELECT 1, publisher_id, 'publish ' || coalesce(topic_name, '?')
FROM main.publisher
WHERE run_id = $run
UNION ALL
SELECT 2, subscription_id, 'take ' || coalesce(topic_name, '?')
FROM main.subscription
WHERE run_id = $run
UNION ALL
SELECT 3, client_id, 'request ' || coalesce(service_name, '?')
FROM main.client
WHERE run_id = $run
UNION ALL
SELECT 4, service_id, 'take request ' || coalesce(service_name, '?')
FROM main.service
WHERE run_id = $run
UNION ALL
SELECT 5, service_id, 'respond ' || coalesce(service_name, '?')
FROM main.service
WHERE run_id = $run
UNION ALL
SELECT 6, client_id, 'take response ' || coalesce(service_name, '?')
FROM main.client
WHERE run_id = $run
UNION ALL
SELECT code, 0, name
FROM (VALUES (0, 'callback'), (1, 'publish ?'), (2, 'take ?'), (3, 'request ?'),
    (4, 'take request ?'), (5, 'respond ?'), (6, 'take response ?')) AS unknown (code, name)
UNION ALL
SELECT 7, id, name
FROM (VALUES (1, 'wait'), (2, 'process'), (3, 'execute')) AS state (id, name)
ORDER BY code, id
"""

SYMBOLS = """
SELECT callback_id AS id, symbol AS name
FROM main.callback
WHERE run_id = $run AND symbol IS NOT NULL
ORDER BY id
"""

# Begins and ends of slices in the order of each track: what ends at a moment before what begins
# there, the inner before the outer, and what begins the other way round.
_IN_ORDER = """
event AS (
    SELECT
        track, start_ns AS at_ns, CASE WHEN end_ns > start_ns THEN 1 ELSE 2 END AS rank,
        end_ns AS far_ns, code, object_id, id, symbol_id
    FROM slice
    UNION ALL
    SELECT track, end_ns, 0, start_ns, code, NULL, id, NULL
    FROM slice
    WHERE end_ns > start_ns
)
"""

# A link begins at the last and ends at the first moment of a request or response that was traced.
SLICES = f"""
WITH slice AS MATERIALIZED (
    SELECT
        i.thread_id * 8 + 2 AS track, i.start_ns, coalesce(i.end_ns, i.start_ns) AS end_ns,
        0 AS code, i.callback_id AS object_id, i.callback_instance_id AS id,
        CASE WHEN c.symbol IS NOT NULL THEN c.callback_id END AS symbol_id
    FROM main.callback_instance AS i
    JOIN main.callback AS c ON i.callback_id = c.callback_id
    WHERE i.run_id = $run AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    UNION ALL
    SELECT thread_id * 8 + 2, start_ns, coalesce(end_ns, start_ns), 1,
        coalesce(publisher_id, 0), publication_id, NULL
    FROM main.publication
    WHERE run_id = $run AND start_ns >= $start_ns AND start_ns < $end_ns
    UNION ALL
    SELECT thread_id * 8 + 2, taken_ns, taken_ns, 2, coalesce(subscription_id, 0), take_id, NULL
    FROM main.take
    WHERE run_id = $run AND taken_ns >= $start_ns AND taken_ns < $end_ns
        AND method <> 'callback_only'
    UNION ALL
    SELECT sender_thread_id * 8 + 2, sent_ns, sent_ns, 3, coalesce(client_id, 0), request_id, NULL
    FROM main.request
    WHERE run_id = $run AND sent_ns >= $start_ns AND sent_ns < $end_ns
        AND sender_thread_id IS NOT NULL
    UNION ALL
    SELECT receiver_thread_id * 8 + 2, taken_ns, taken_ns, 4, coalesce(service_id, 0), request_id,
        NULL
    FROM main.request
    WHERE run_id = $run AND taken_ns >= $start_ns AND taken_ns < $end_ns
        AND receiver_thread_id IS NOT NULL
    UNION ALL
    SELECT sender_thread_id * 8 + 2, sent_ns, sent_ns, 5, coalesce(service_id, 0), response_id,
        NULL
    FROM main.response
    WHERE run_id = $run AND sent_ns >= $start_ns AND sent_ns < $end_ns
        AND sender_thread_id IS NOT NULL
    UNION ALL
    SELECT receiver_thread_id * 8 + 2, taken_ns, taken_ns, 6, coalesce(client_id, 0), response_id,
        NULL
    FROM main.response
    WHERE run_id = $run AND taken_ns >= $start_ns AND taken_ns < $end_ns
        AND receiver_thread_id IS NOT NULL
),
link AS (
    SELECT
        CASE l.from_kind WHEN 'callback_instance' THEN 0 WHEN 'publication' THEN 1
            WHEN 'take' THEN 2 ELSE CASE WHEN q.taken_ns IS NULL THEN 3 ELSE 4 END
        END AS from_code,
        l.from_id,
        CASE l.to_kind WHEN 'callback_instance' THEN 0 WHEN 'publication' THEN 1
            WHEN 'take' THEN 2 WHEN 'request' THEN CASE WHEN o.sent_ns IS NULL THEN 4 ELSE 3 END
            ELSE CASE WHEN r.sent_ns IS NULL THEN 6 ELSE 5 END
        END AS to_code,
        l.to_id,
        l.link_kind
    FROM main.flow_edge AS l
    LEFT JOIN main.request AS q ON l.from_kind = 'request' AND l.from_id = q.request_id
    LEFT JOIN main.request AS o ON l.to_kind = 'request' AND l.to_id = o.request_id
    LEFT JOIN main.response AS r ON l.to_kind = 'response' AND l.to_id = r.response_id
    WHERE l.run_id = $run
    UNION ALL
    SELECT 3, request_id, 4, request_id, 'transport'
    FROM main.request
    WHERE run_id = $run AND sent_ns IS NOT NULL AND taken_ns IS NOT NULL
    UNION ALL
    SELECT 5, response_id, 6, response_id, 'transport'
    FROM main.response
    WHERE run_id = $run AND sent_ns IS NOT NULL AND taken_ns IS NOT NULL
),
-- Arrows of which both ends are drawn.
arrow AS MATERIALIZED (
    SELECT l.from_code, l.from_id, l.to_code, l.to_id,
        hash(l.from_code, l.from_id, l.to_code, l.to_id, l.link_kind) AS arrow_id
    FROM link AS l
    SEMI JOIN slice AS f ON l.from_code = f.code AND l.from_id = f.id
    SEMI JOIN slice AS t ON l.to_code = t.code AND l.to_id = t.id
),
outgoing AS (
    SELECT from_code AS code, from_id AS id, list(arrow_id ORDER BY arrow_id) AS arrows
    FROM arrow
    GROUP BY from_code, from_id
),
incoming AS (
    SELECT to_code AS code, to_id AS id, list(arrow_id ORDER BY arrow_id) AS arrows
    FROM arrow
    GROUP BY to_code, to_id
),
{_IN_ORDER}
SELECT
    e.track, e.at_ns, e.rank, e.object_id * 8 + e.code + 1 AS name, e.code, e.id,
    e.symbol_id, o.arrows AS outgoing, i.arrows AS incoming
FROM event AS e
LEFT JOIN outgoing AS o ON e.rank > 0 AND e.code = o.code AND e.id = o.id
LEFT JOIN incoming AS i ON e.rank > 0 AND e.code = i.code AND e.id = i.id
ORDER BY e.track, e.at_ns, e.rank, e.far_ns DESC, e.code, e.id
"""

STATES = f"""
WITH slice AS (
    SELECT
        thread_id * 8 + 3 AS track, start_ns, coalesce(end_ns, start_ns) AS end_ns, 7 AS code,
        list_position(['wait', 'process', 'execute'], state) AS object_id,
        executor_id AS id, NULL::BIGINT AS symbol_id
    FROM main.executor_state
    WHERE run_id = $run AND start_ns >= $start_ns AND start_ns < $end_ns
),
{_IN_ORDER}
SELECT
    track, at_ns, rank, object_id * 8 + code + 1 AS name, code, id, symbol_id,
    NULL::UBIGINT[] AS outgoing, NULL::UBIGINT[] AS incoming
FROM event
ORDER BY track, at_ns, rank, far_ns DESC, id
"""

# Gaps of a host, those that touch as one: slices of a track are disjoint or nested.
GAPS = """
WITH gap AS (
    SELECT
        t.host_id, g.kind, g.event_count,
        greatest(g.start_ns, $start_ns) AS start_ns,
        least(g.end_ns, $end_ns) AS end_ns
    FROM main.loss_interval AS g
    JOIN main.trace AS t ON g.trace_id = t.trace_id
    WHERE g.run_id = $run AND g.start_ns < $end_ns AND g.end_ns >= $start_ns
),
begun AS (
    SELECT
        host_id, kind, event_count, start_ns, end_ns,
        coalesce(start_ns > max(end_ns) OVER (
            PARTITION BY host_id ORDER BY start_ns, end_ns
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), true) AS is_first
    FROM gap
),
numbered AS (
    SELECT
        host_id, kind, event_count, start_ns, end_ns,
        sum(is_first::BIGINT) OVER (
            PARTITION BY host_id ORDER BY start_ns, end_ns ROWS UNBOUNDED PRECEDING
        ) AS island
    FROM begun
)
SELECT
    n.host_id * 8 + 6 AS track,
    h.hostname || ': not recorded' AS track_name,
    'not recorded: ' || string_agg(DISTINCT n.kind, ', ' ORDER BY n.kind) AS name,
    min(n.start_ns) AS start_ns,
    max(n.end_ns) AS end_ns,
    sum(n.event_count)::BIGINT AS event_count
FROM numbered AS n
JOIN main.host AS h ON n.host_id = h.host_id
GROUP BY n.host_id, h.hostname, n.island
ORDER BY track, start_ns
"""

# Rates from each publication to the one before; messages that were published and later taken.
VALUES = """
WITH rate AS (
    SELECT
        publisher_id * 8 + 4 AS track, start_ns AS at_ns,
        1e9 / nullif(start_ns - lag(start_ns) OVER (
            PARTITION BY publisher_id ORDER BY start_ns, publication_id
        ), 0) AS value
    FROM main.publication
    WHERE run_id = $run AND start_ns >= $start_ns AND start_ns < $end_ns
        AND publisher_id IS NOT NULL
),
step AS (
    SELECT
        t.subscription_id, unnest([b.end_ns, t.taken_ns]) AS at_ns, unnest([1, -1]) AS step,
        t.take_id
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    WHERE l.run_id = $run AND t.subscription_id IS NOT NULL AND t.taken_ns >= b.end_ns
        AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
),
queue AS (
    SELECT
        subscription_id * 8 + 5 AS track, at_ns, take_id,
        sum(step) OVER (
            PARTITION BY subscription_id ORDER BY at_ns, step DESC, take_id
            ROWS UNBOUNDED PRECEDING
        )::DOUBLE AS value,
        row_number() OVER (
            PARTITION BY subscription_id ORDER BY at_ns, step DESC, take_id
        ) AS place
    FROM step
)
SELECT track, at_ns, value, 0 AS place FROM rate WHERE value IS NOT NULL
UNION ALL
SELECT track, at_ns, value, place FROM queue
ORDER BY track, at_ns, place
"""
