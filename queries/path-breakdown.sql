-- title: What the latency of each path consists of
-- description: End-to-end latency of every path, hop by hop, in the order of the path: --sort
--     share:desc puts the largest part first. The parts add up to the latency: the callback up to
--     its publication; the wait in a cache; calls of services; publishing by layer, up to the last
--     one; the time from there to the take, in which publishing goes on; and the time from the take
--     to the callback. Flows with a stored message are left out. A trace does not say when a
--     message arrived: the time up to the take is network_or_idle, executor_busy (with other
--     callbacks, at least), and undecided (one or the other). Where a kernel trace or CARET shows
--     it exactly, the parts are until_arrival, run_queue (the thread was woken, and waited for a
--     CPU) and executor instead. A part is negative if the next one began before it ended
--     (overlaps).
-- grain: one row per path, hop, part, and callback that it belongs to
-- reads: path_chain, path_outcome, named_path
-- param: from, to, from_event, to_event, case, max_depth, max_paths
-- column: run_id
-- column: path_id BIGINT           Number of the path; of several with the same nodes and topics
--     the first
-- column: hop
-- column: part VARCHAR             'callback', 'cache', 'service', a layer of publishing
--     ('intra', 'rclcpp', 'rcl', 'rmw', 'dds', or 'publish' where it is not known),
--     'network_or_idle', 'undecided', 'executor_busy', or exactly 'until_arrival', 'run_queue',
--     'executor'; 'take_to_callback'
-- column: node VARCHAR [node]  Node that runs the callback, waits for it or for the message, or
--     publishes; 'between nodes' where neither worked: network_or_idle and until_arrival
-- column: what
-- column: flows BIGINT             Flows with this part
-- column: ambiguous BIGINT         Flows of the path that pass a link that may be another one (a
--     candidate_count above 1)
-- column: overlaps BIGINT          Flows in which it is negative
-- column: median_ns, mean_ns, p95_ns, max_ns
-- column: share DOUBLE [share]     Part of the time of all flows of the path, rounded to 4 places
-- column: total_ns BIGINT [ns]     Sum over all flows; all parts add up to their time
-- column: is_cut, path
-- brief: path, hop, part, node, what, median_ns, share, max_ns, ambiguous, p95_ns, mean_ns,
--     total_ns (not 0), flows, overlaps
-- note: clocks
CREATE OR REPLACE TEMP TABLE breakdown_flow AS
FROM main.chosen_flow('path_outcome', $case);

CREATE OR REPLACE TEMP TABLE breakdown_trail AS
FROM main.end_to_end_trail('breakdown_flow', $runs, chains := 'path_chain');

CREATE OR REPLACE TEMP TABLE breakdown_wait AS
SELECT callback_instance_id, executor_id, busy_min_ns, busy_max_ns, held_max_ns
FROM main.executor_wait
WHERE list_contains($runs, run_id);

-- Every callback instance, and how long its executor was busy before it.
CREATE OR REPLACE TEMP TABLE breakdown_callback AS
SELECT
    i.callback_instance_id, i.callback_id, i.take_id, i.start_ns, i.end_ns, w.busy_min_ns,
    -- Of one thread: while it neither waited nor ran callbacks, the message may lie in its queue.
    w.busy_max_ns + CASE WHEN e.kind LIKE 'multi_threaded%' THEN 0
        ELSE coalesce(w.held_max_ns, 0) END AS busy_max_ns
FROM main.callback_instance AS i
LEFT JOIN breakdown_wait AS w ON i.callback_instance_id = w.callback_instance_id
LEFT JOIN main.executor AS e ON w.executor_id = e.executor_id
WHERE list_contains($runs, i.run_id);

-- when: main.thread_state, main.data_arrival
-- columns: take_id BIGINT, until_arrival_ns BIGINT, run_queue_ns BIGINT, executor_ns BIGINT
CREATE OR REPLACE TEMP TABLE exact_arrival AS
SELECT take_id, until_arrival_ns, run_queue_ns, executor_ns
FROM main.arrival
WHERE list_contains($runs, run_id) AND is_exact AND executor_ns IS NOT NULL;

CREATE OR REPLACE TEMP TABLE breakdown_arrival AS
SELECT h.flow_id, h.hop, a.run_queue_ns, a.executor_ns
FROM breakdown_trail AS h
JOIN exact_arrival AS a ON h.take_id = a.take_id;

-- A node that began again, or has several callbacks of one label, has one row.
WITH labelled AS (
    SELECT
        callback_id,
        min(callback_id) OVER (PARTITION BY run_id, node, label) AS first_id
    FROM main.callback_label
    WHERE list_contains($runs, run_id)
),
-- Between clocks that are apart the time that they show may be shorter than the executor was busy.
piece AS (
    SELECT
        d.alike_id AS path_id,
        p.flow_id, p.hop, p.rank, p.part, p.duration_ns, p.is_turning,
        k.first_id AS callback_id,
        least(coalesce(p.busy_min_ns, 0), greatest(p.duration_ns, 0)) AS busy_min_ns,
        least(coalesce(p.busy_max_ns, p.duration_ns), greatest(p.duration_ns, 0)) AS busy_max_ns,
        a.run_queue_ns, a.executor_ns,
        -- The time up to a take is three parts, all others are one.
        unnest(
            CASE
                WHEN a.run_queue_ns IS NOT NULL THEN ['until_arrival', 'run_queue', 'executor']
                WHEN a.executor_ns IS NOT NULL THEN ['until_arrival', 'executor']
                WHEN p.part IN ('publish_to_take', 'request_to_take')
                    THEN ['network_or_idle', 'undecided', 'executor_busy']
                ELSE [p.part]
            END
        ) AS piece
    FROM main.end_to_end_piece_explained(
        'breakdown_flow', 'breakdown_trail', 'breakdown_callback', $runs,
        has_turns := $has_turns
    ) AS p
    LEFT JOIN breakdown_arrival AS a
        ON p.flow_id = a.flow_id AND p.hop = a.hop AND p.part = 'publish_to_take'
    JOIN named_path AS d ON p.path_id = d.path_id
    LEFT JOIN labelled AS k ON p.callback_id = k.callback_id
),
part AS (
    SELECT
        path_id, flow_id, hop, rank,
        piece AS part,
        is_turning,
        CASE piece
            WHEN 'network_or_idle' THEN duration_ns - greatest(busy_max_ns, busy_min_ns)
            WHEN 'undecided' THEN greatest(busy_max_ns - busy_min_ns, 0)
            WHEN 'executor_busy' THEN busy_min_ns
            WHEN 'until_arrival' THEN duration_ns - coalesce(run_queue_ns, 0) - executor_ns
            WHEN 'run_queue' THEN run_queue_ns
            WHEN 'executor' THEN executor_ns
            ELSE duration_ns
        END AS duration_ns,
        CASE
            WHEN piece NOT IN ('network_or_idle', 'until_arrival') OR part = 'request_to_take'
                THEN callback_id
        END AS callback_id,
        -- Where no callback is traced, the node that took the message is known all the same.
        callback_id IS NULL
            AND part = 'publish_to_take'
            AND piece NOT IN ('network_or_idle', 'until_arrival') AS is_of_reader
    FROM piece
),
measured AS (
    SELECT
        path_id, hop, part, callback_id, is_of_reader,
        min(rank) AS rank,
        -- DISTINCT would tell all flows apart, not only these: that takes most of the memory.
        count(*) FILTER (WHERE NOT is_turning)
        + coalesce(len(list_distinct(list(flow_id) FILTER (WHERE is_turning))), 0) AS flows,
        count(*) FILTER (WHERE duration_ns < 0) AS overlaps,
        quantile_disc(duration_ns, [0.5, 0.95]) AS quantiles,
        round(avg(duration_ns))::BIGINT AS mean_ns,
        max(duration_ns) AS max_ns,
        sum(duration_ns)::BIGINT AS total_ns
    FROM part
    GROUP BY path_id, hop, part, callback_id, is_of_reader
),
message AS (
    SELECT
        p.run_id, p.path_id, p.path, p.is_cut,
        unnest(range(1, len(p.topics) + 1)) AS hop,
        unnest(p.topics) AS topic_name,
        unnest(p.publishers) AS publisher_id,
        unnest(p.subscriptions) AS subscription_id
    FROM named_path AS p
    WHERE p.is_path
),
doubted AS (
    SELECT
        p.alike_id AS path_id,
        count(*) FILTER (WHERE f.is_ambiguous) AS flows
    FROM breakdown_flow AS f
    JOIN named_path AS p ON f.path_id = p.path_id
    GROUP BY p.alike_id
)
SELECT
    p.run_id, m.path_id, m.hop, m.part,
    CASE
        WHEN m.part IN ('network_or_idle', 'until_arrival') THEN 'between nodes'
        ELSE coalesce(l.node, main.node_label(n.full_name, r.name, r.pid))
    END AS node,
    coalesce(l.label, h.topic_name) AS what,
    m.flows,
    d.flows AS ambiguous,
    m.overlaps,
    m.quantiles[1] AS median_ns,
    m.mean_ns,
    m.quantiles[2] AS p95_ns,
    m.max_ns,
    round(m.total_ns / nullif(sum(m.total_ns) OVER (PARTITION BY m.path_id), 0), 4) AS share,
    m.total_ns, p.is_cut, p.path
FROM measured AS m
JOIN doubted AS d ON m.path_id = d.path_id
JOIN message AS p ON m.path_id = p.path_id AND p.hop = 1
LEFT JOIN message AS h ON m.path_id = h.path_id AND m.hop = h.hop
LEFT JOIN main.publisher AS b ON h.publisher_id = b.publisher_id
LEFT JOIN main.subscription AS s ON h.subscription_id = s.subscription_id
LEFT JOIN main.process AS r
    ON CASE WHEN m.is_of_reader THEN s.process_id ELSE b.process_id END = r.process_id
LEFT JOIN main.node AS n ON CASE WHEN m.is_of_reader THEN s.node_id ELSE b.node_id END = n.node_id
LEFT JOIN main.callback_label AS l ON m.callback_id = l.callback_id
ORDER BY
    p.run_id, p.path, m.path_id, m.hop, m.rank,
    list_position(
        [
            'until_arrival', 'run_queue', 'executor', 'network_or_idle', 'undecided',
            'executor_busy'
        ],
        m.part
    ),
    m.part, m.callback_id
