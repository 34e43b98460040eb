-- title: What the slowest flows waited for
-- description: The slowest flows, piece by piece; of one message: msgflow flow --why. Waits are
--     replaced by what they waited for, as far as the trace shows; where the kernel was traced,
--     what a thread did by its states (docs/scheduling.md). The pieces add up to the latency.
--     Unless detail is full, those of one hop that are the same, such as the callbacks of earlier
--     messages before which a message waits, are one row, at the place of the first. What is below
--     1 % then is summed up by activity, state and node, or as 'rest'. Flows with a stored message
--     have no latency, and are left out.
-- grain: one row per flow and piece, or pieces that are the same, node or activity
-- reads: path_chain, path_outcome, named_path
-- param: from, to, via, without
-- param: slowest BIGINT {1..} = 1  Number of flows
-- param: quantile VARCHAR {median|p90|p95|p99|max} = NULL  Instead, the flow at this quantile of
--     the latency
-- param: take BIGINT = NULL  Instead, the longest flow to this take_id; on the command line:
--     msgflow flow --take ID --why
-- param: case
-- param: by VARCHAR {piece|node|part} = 'piece'  Rows by piece, by node, or by activity and state
-- param: detail VARCHAR {short|full} = 'short'  full: every piece and layer of publishing
-- param: from_event, to_event, max_depth, max_paths
-- column: run_id
-- column: rank BIGINT              Number of the flow, the slowest first
-- column: at_ns BIGINT [ns]        Start, since the start of the flow, of the first of several
--     pieces; empty where they are summed up
-- column: duration_ns BIGINT [ns]  Duration; negative if parts of the flow overlap
-- column: hop
-- column: part VARCHAR             Part of the flow: 'callback', 'cache', 'request_to_take',
--     'service', 'response_to_take', 'publish' or its layer, 'publish_to_take' or
--     'take_to_callback'
-- column: activity VARCHAR  What happened: the part itself; up to a take 'network_or_idle',
--     'executor_busy' (it ran something else), 'all_threads_busy', 'blocked' (a callback ran that
--     excludes the waiting one) or 'undecided' (nothing shows when the message arrived); in a cache
--     'timer' (not due yet), 'unpublished' (the message that was waited for had not been
--     published), or a part of that message's own flow; 'rest': pieces too short for a line of
--     their own
-- column: state VARCHAR            What the thread did, as in thread_state, where the kernel was
--     traced
-- column: who VARCHAR              What took the CPU, or ended the sleep: thread or interrupt;
--     where another thread was waited for, that one, with what took its CPU, or ended its sleep,
--     in brackets
-- column: node VARCHAR [node]      Node that did it, or that waited; 'between nodes' where neither
--     worked: network_or_idle, unless its thread is known to have run or waited for a CPU
-- column: what
-- column: share DOUBLE [share]     Part of the latency, rounded to 4 places
-- column: pieces BIGINT            Number of pieces in the row
-- column: is_certain BOOLEAN       For 'executor_busy', 'all_threads_busy' and 'blocked': what
--     waited was ready by then; no: it may have arrived during this piece
-- column: thread VARCHAR           Thread in that state
-- column: wakers BIGINT            How many wakers lead to that thread: 0 for the one that waited
-- column: priority INTEGER         Its priority to the kernel; below 100 real-time
-- column: who_priority INTEGER     Priority of what took the CPU
-- column: from_ns
-- column: callback_instance_id BIGINT  Identity of the callback instance, of several the first
-- column: publication_id
-- column: take_id BIGINT           Take at the end of the flow
-- column: latency_ns BIGINT [ns]   Latency of the whole flow
-- column: is_ambiguous BOOLEAN     The flow passes a link that may be another one (a
--     candidate_count above 1), so that it may be none; only in its first row, as the next two
-- column: is_cut BOOLEAN           Paths of the run were left out beyond max_depth or max_paths:
--     one may have a slower flow
-- column: path VARCHAR [path]      Nodes and topics of the flow
-- brief: rank (heading), at_ns, duration_ns, share, activity, state, who, node, what, is_certain,
--     pieces, hop, part, thread, wakers, priority, who_priority, latency_ns (heading),
--     take_id (heading), is_ambiguous (heading), path (heading)
-- note: clocks
-- next: flow --take {take_id} --why
CREATE OR REPLACE TEMP TABLE critical_flow AS
WITH path AS (
    SELECT path_id
    FROM named_path
    WHERE ($via IS NOT NULL OR $without IS NOT NULL) AND main.path_visits(path, $via, $without)
)
FROM main.chosen_flow(
    'path_outcome', $case, sink_take_id := $take, most_flows := $slowest,
    at_quantile := CASE $quantile WHEN 'median' THEN 0.5 WHEN 'p90' THEN 0.9 WHEN 'p95' THEN 0.95
        WHEN 'p99' THEN 0.99 WHEN 'max' THEN 1.0 END,
    path_ids := CASE WHEN $via IS NOT NULL OR $without IS NOT NULL
        THEN (SELECT coalesce(list(path_id), []) FROM path) END
);

CREATE OR REPLACE TEMP TABLE critical_trail AS
FROM main.end_to_end_trail('critical_flow', $runs, chains := 'path_chain');

CREATE OR REPLACE TEMP TABLE critical_part AS
FROM main.end_to_end_piece('critical_flow', 'critical_trail', $runs);

CREATE OR REPLACE TEMP TABLE critical_piece AS
FROM main.critical_piece(
    'critical_part', $runs, has_kernel := $has_kernel, has_calls := $has_calls,
    has_teams := $has_teams
);

WITH untraced AS (
    -- What a thread did without a traced callback led to the message that comes next, unless it
    -- called a service.
    SELECT
        *,
        CASE
            WHEN part <> 'callback' OR callback_instance_id IS NOT NULL THEN publication_id
            ELSE first_value(
                CASE WHEN part <> 'callback' THEN coalesce(publication_id, -1) END IGNORE NULLS
            ) OVER (
                PARTITION BY flow_rank ORDER BY position
                ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
            )
        END AS message_id
    FROM critical_piece
),
-- A row per message: the list of a long path in each of its pieces would take much memory.
reader AS (
    SELECT
        path_id,
        unnest(range(1, len(subscriptions) + 1)) AS hop,
        unnest(subscriptions) AS subscription_id
    FROM named_path
    WHERE path_id IN (SELECT path_id FROM critical_part)
),
piece AS (
    SELECT
        c.run_id, c.flow_rank, c.position,
        c.from_ns - min(CASE WHEN c.position = 1 THEN c.from_ns END)
            OVER (PARTITION BY c.flow_rank) AS at_ns,
        c.duration_ns, c.hop, c.part, c.activity,
        CASE
            WHEN c.activity = 'network_or_idle'
                AND coalesce(c.state, 'unknown') IN ('sleeping', 'unknown')
                THEN 'between nodes'
            WHEN c.request_id IS NOT NULL THEN coalesce(l.node, v.server, '?')
            ELSE coalesce(l.node, main.node_label(n.full_name, r.name, r.pid), o.node)
        END AS node,
        CASE
            WHEN c.activity = 'callback' THEN coalesce(l.label, p.topic_name)
            WHEN c.activity IN (
                'cache', 'take_to_callback', 'service', 'executor_busy',
                'all_threads_busy', 'blocked', 'timer'
            ) OR c.part = 'request_to_take'
                THEN coalesce(l.label, printf('Service(%s)', v.service_name))
            WHEN c.request_id IS NOT NULL THEN printf('Service(%s)', v.service_name)
            ELSE coalesce(p.topic_name, s.topic_name, '?')
        END AS what,
        c.is_certain, c.from_ns, c.callback_instance_id, c.publication_id, c.take_id, c.latency_ns,
        c.path_id, c.state, c.wakers,
        printf('%s %d', coalesce(t.name, '?'), t.tid) AS thread,
        c.priority,
        CASE
            WHEN bt.thread_id IS NOT NULL THEN printf('%s %d', bl.label, bt.tid)
            WHEN c.by_kind = 'thread' THEN bo.name
            ELSE c.by_kind
        END AS by_whom,
        CASE
            WHEN c.wakers > 0
                THEN printf('%s %d', tl.label, t.tid)
                || CASE WHEN c.state = 'running' THEN ''
                    ELSE printf(' (%s)', coalesce(by_whom, '?')) END
            ELSE by_whom
        END AS who,
        c.by_priority AS who_priority,
        $detail = 'short' AND c.activity IN ('intra', 'rclcpp', 'rcl', 'rmw', 'dds')
            AND c.part = c.activity AS is_layer
    FROM untraced AS c
    LEFT JOIN (FROM main.thread WHERE $has_kernel) AS t ON c.state_thread_id = t.thread_id
    -- Where no callback is traced, the only node of the process that did it.
    LEFT JOIN (
        SELECT
            process_id,
            any_value(full_name) AS node
        FROM main.node
        WHERE $has_kernel
        GROUP BY process_id
        HAVING count(*) = 1
    ) AS o
        ON t.process_id = o.process_id AND c.wakers = 0
    LEFT JOIN (FROM main.thread WHERE $has_kernel) AS bt ON c.by_thread_id = bt.thread_id
    LEFT JOIN (FROM main.thread_label WHERE $has_kernel) AS tl
        ON c.state_thread_id = tl.thread_id
    LEFT JOIN (FROM main.thread_label WHERE $has_kernel) AS bl
        ON c.by_thread_id = bl.thread_id
    LEFT JOIN (FROM main.other_thread WHERE $has_kernel) AS bo
        ON c.by_other_thread_id = bo.other_thread_id
    LEFT JOIN main.callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
    LEFT JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    LEFT JOIN (FROM main.waited_call WHERE $has_calls) AS v
        ON c.request_id = v.request_id AND list_contains($runs, v.run_id)
    LEFT JOIN main.publication AS b ON c.message_id = b.publication_id
    LEFT JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    -- Who waits for a message is the node that takes it, with a traced callback or without.
    LEFT JOIN reader AS w ON c.part = 'publish_to_take' AND c.path_id = w.path_id AND c.hop = w.hop
    LEFT JOIN main.subscription AS s ON w.subscription_id = s.subscription_id
    LEFT JOIN main.process AS r ON coalesce(s.process_id, b.process_id) = r.process_id
    LEFT JOIN main.node AS n ON CASE WHEN s.subscription_id IS NULL THEN p.node_id ELSE s.node_id
        END = n.node_id
),
-- The layers of one publication follow each other. States of a callback alternate.
folded AS (
    SELECT
        run_id, flow_rank,
        min(position) AS position,
        min(at_ns) AS at_ns,
        sum(duration_ns)::BIGINT AS duration_ns,
        hop,
        CASE WHEN is_layer THEN 'publish' ELSE part END AS part,
        CASE WHEN is_layer THEN 'publish' ELSE activity END AS activity,
        node, what, is_certain,
        min(from_ns) AS from_ns,
        callback_instance_id, publication_id, take_id, latency_ns, path_id, state, who, thread,
        wakers, priority, who_priority, is_layer,
        CASE WHEN NOT is_layer AND ($detail = 'full' OR state IS NULL) THEN position END AS alone,
        count(*) FILTER (WHERE NOT is_layer) AS pieces
    FROM piece
    GROUP BY ALL
),
sorted AS (
    SELECT
        * REPLACE (greatest(pieces, 1) AS pieces),
        min(position) OVER equal AS first_position,
        $detail = 'full' OR abs(sum(duration_ns) OVER equal) >= 0.01 * latency_ns AS is_long
    FROM folded
    WINDOW equal AS (
        PARTITION BY flow_rank, hop, part, activity, state, node, what, who, wakers
    )
),
-- What is too short by itself is not, perhaps, with all that a node did in the same way.
keyed AS (
    SELECT
        *,
        CASE
            WHEN $by = 'node' THEN coalesce(node, '')
            WHEN $by = 'part' THEN concat_ws(' ', activity, state)
            WHEN $detail = 'full' THEN position::VARCHAR
            WHEN is_long THEN first_position::VARCHAR
            WHEN abs(sum(duration_ns) OVER short) < 0.01 * latency_ns THEN 'rest'
            ELSE concat_ws(' ', 'short', activity, state, node)
        END AS row_key
    FROM sorted
    WINDOW short AS (PARTITION BY flow_rank, is_long, activity, state, node)
),
summed AS MATERIALIZED (
    SELECT
        run_id, flow_rank, take_id, latency_ns, path_id, row_key,
        min(position) AS position,
        sum(duration_ns)::BIGINT AS duration_ns,
        round(sum(duration_ns) / nullif(latency_ns, 0), 4) AS share,
        sum(pieces)::BIGINT AS pieces,
        $by = 'piece' AND bool_and(is_long) AS is_piece,
        CASE WHEN is_piece THEN arg_min(
            struct_pack(
                at_ns, hop, part, what, who, thread, wakers, priority, who_priority, from_ns,
                callback_instance_id, publication_id
            ),
            position
        ) END AS piece,
        CASE WHEN is_piece THEN bool_and(is_certain) END AS is_certain,
        CASE
            WHEN $by = 'piece' AND row_key = 'rest' THEN 'rest'
            WHEN $by <> 'node' THEN any_value(activity)
        END AS activity,
        CASE WHEN $by <> 'part' AND row_key <> 'rest' THEN any_value(node) END AS node,
        CASE WHEN $by <> 'node' AND row_key <> 'rest' THEN any_value(state) END AS state
    FROM keyed
    GROUP BY run_id, flow_rank, take_id, latency_ns, path_id, row_key
),
ordered AS (
    SELECT
        *,
        row_number() OVER (
            PARTITION BY run_id, flow_rank
            ORDER BY
                row_key = 'rest',
                CASE WHEN $by = 'piece' THEN position END,
                duration_ns DESC,
                row_key
        ) AS place
    FROM summed
),
-- Flows in the order of their pieces.
doubted AS (
    SELECT
        dense_rank() OVER (ORDER BY latency_ns DESC, flow_id) AS flow_rank,
        is_ambiguous
    FROM critical_flow
)
SELECT
    s.run_id,
    s.flow_rank AS rank,
    s.piece.at_ns, s.duration_ns, s.piece.hop, s.piece.part, s.activity, s.state, s.piece.who,
    s.node, s.piece.what, s.share, s.pieces, s.is_certain, s.piece.thread, s.piece.wakers,
    s.piece.priority, s.piece.who_priority, s.piece.from_ns, s.piece.callback_instance_id,
    s.piece.publication_id, s.take_id, s.latency_ns,
    -- The path of a flow of a thousand hops is long: only the first of its rows has it.
    CASE WHEN s.place = 1 THEN d.is_ambiguous END AS is_ambiguous,
    CASE
        WHEN s.place = 1
            THEN s.run_id IN (SELECT run_id FROM named_path WHERE is_cut)
    END AS is_cut,
    n.path
FROM ordered AS s
JOIN doubted AS d ON s.flow_rank = d.flow_rank
LEFT JOIN named_path AS n ON s.path_id = n.path_id AND s.place = 1
ORDER BY s.run_id, s.flow_rank, s.place
