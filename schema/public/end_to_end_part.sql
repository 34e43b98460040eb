-- name: main.end_to_end_part
-- kind: macro
-- description: What the latency of each flow of each path (main.end_to_end) consists of. The parts
--     of a flow follow each other without a gap from its start to its end, so their durations add
--     up to its latency exactly. A part is negative if the next one began before it ended: clocks
--     of two hosts are apart, a message was taken before the publishing call returned, or a
--     callback published for an input whose own callback was still running.
-- grain: one row per flow that reached the sink and part
-- param: runs BIGINT[]  Runs to look at
-- param: from_topic VARCHAR = NULL  Topics or nodes where flows start: names or globs, separated by
--     commas; NULL: any
-- param: to_topic VARCHAR = NULL  Topics or nodes where flows end, in the same form; NULL: any
-- param: from_event VARCHAR = 'callback_start'  Event that starts the clock: 'callback_start' or
--     'publish'; others are an error
-- param: to_event VARCHAR = 'callback_end'  Event that stops it: 'take', 'callback_start' or
--     'callback_end'; others are an error
-- param: window_start_ns BIGINT = NULL  Start of the time window of roots, epoch ns; NULL: any
-- param: window_end_ns BIGINT = NULL  End of the time window of roots, epoch ns, exclusive;
--     NULL: any
-- param: flow_case VARCHAR = 'first'  Pairs of root and arrival: 'first', 'last', 'newest',
--     'every_pair', or
--     'longest', the one flow of all that took longest
-- param: sink_take_id BIGINT = NULL  Only flows that end with this take
-- param: max_depth INTEGER = 32  Longest chain, in topics
-- param: max_paths INTEGER = 1000  Maximum number of paths, shortest first; also the limit on
--     chains of each length
-- param: most_flows INTEGER = 1  Of 'longest', how many
-- param: at_quantile DOUBLE = NULL  Of 'longest', in its place the flow with this quantile of the
--     latency, 0 to 1
-- param: path_ids BIGINT[] = NULL  Only these paths; NULL: all
-- column: run_id BIGINT  Run
-- column: path_id BIGINT  Path, as main.flow_path numbers it for the same arguments
-- column: flow_id BIGINT  Number of the flow in this result
-- column: root_kind VARCHAR  'callback_instance' or 'publication'
-- column: root_id BIGINT  Identity of the root
-- column: take_id BIGINT  Take at the end of the path
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position BIGINT  Order within the flow, from 1
-- column: part VARCHAR  'callback' (from its start, or from the take where none shows, to what it
--     publishes or calls), 'cache' (from the end of the callback to the callback instance that
--     publishes for it),
--     'intra', 'rclcpp', 'rcl', 'rmw', 'dds' (publishing, from this layer to the next), 'publish'
--     (publishing, layer not known), 'publish_to_take' (from its end to the take: the network, an
--     idle executor or a busy one, see main.executor_wait), 'take_to_callback', 'request_to_take'
--     (from the sending of a request), 'service' (from the start of the service callback to what
--     it publishes or calls)
-- column: from_ns BIGINT [epoch ns]  Begin
-- column: to_ns BIGINT [epoch ns]  End
-- column: duration_ns BIGINT [ns]  to_ns - from_ns
-- column: callback_instance_id BIGINT  Callback instance that it is, or that it waits for
-- column: publication_id BIGINT  Message that is published or under way
-- needs: derive.known_word, main.end_to_end, derive.flow_chain, main.publication, main.take,
--     main.callback_instance,
--     main.request, derive.flow_transport, derive.flow_call, derive.flow_root,
--     store.callback_instance, store.link_causal, store.link_request
CREATE OR REPLACE MACRO main.end_to_end_part(
    runs, from_topic := NULL, to_topic := NULL, from_event := 'callback_start',
    to_event := 'callback_end', window_start_ns := NULL, window_end_ns := NULL,
    flow_case := 'first', sink_take_id := NULL, max_depth := 32, max_paths := 1000, most_flows := 1,
    at_quantile := NULL, path_ids := NULL
) AS TABLE
WITH RECURSIVE flow AS MATERIALIZED (
    SELECT
        row_number() OVER (
            ORDER BY e.path_id, e.root_ns, e.root_kind, e.root_id, e.sink_ns, e.take_id
        ) AS flow_id,
        e.run_id, e.path_id, e.root_kind, e.root_id, e.root_ns, e.take_id, e.sink_event, e.sink_ns,
        e.latency_ns
    FROM main.end_to_end(
        runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
        max_depth := max_depth, max_paths := max_paths
    ) AS e
    WHERE derive.known_word(
            'flow_case', flow_case, ['first', 'last', 'newest', 'every_pair', 'longest']
        )
        AND e.status = 'reached'
        AND coalesce(e.take_id = sink_take_id, true)
        AND CASE flow_case
            WHEN 'first' THEN e.is_first
            WHEN 'last' THEN e.is_last
            WHEN 'newest' THEN e.is_newest
            ELSE true
        END
        AND (path_ids IS NULL OR list_contains(path_ids, e.path_id))
    -- The quantile is one that occurred: so many flows took no longer.
    QUALIFY CASE
        WHEN flow_case <> 'longest' THEN true
        WHEN at_quantile IS NULL THEN row_number() OVER (
            ORDER BY e.latency_ns DESC, e.path_id, e.root_ns, e.root_kind, e.root_id, e.take_id
        ) <= most_flows
        ELSE row_number() OVER (
            ORDER BY e.latency_ns, e.path_id, e.root_ns, e.root_kind, e.root_id, e.take_id
        ) = greatest(1, ceil(at_quantile * count(*) OVER ()))
    END
),
chain AS MATERIALIZED (
    SELECT path_id, parent_path_id, depth, publisher_id, subscription_id, route
    FROM derive.flow_chain(
        runs, from_topic, to_topic, max_depth := max_depth, max_paths := max_paths
    )
),
transport AS MATERIALIZED (
    SELECT publication_id, publisher_id, take_id
    FROM derive.flow_transport
    WHERE list_contains(runs, run_id)
),
-- What led to each publication: the callback instance that the flow came in with, and the one
-- (of a service that it called) that the publication is linked to.
continuation AS MATERIALIZED (
    SELECT
        l.publication_id, l.take_id, l.subscription_id,
        l.callback_instance_id AS entered_id, l.callback_instance_id AS left_id, l.kind,
        []::BIGINT[] AS route
    FROM store.link_causal AS l
    WHERE list_contains(runs, l.run_id)
    UNION ALL
    SELECT
        publication_id, take_id, subscription_id, caller_id, callback_instance_id, kind, route
    FROM derive.flow_call
    WHERE list_contains(runs, run_id)
),
-- Steps back: from a publication to the message that led to it.
step AS MATERIALIZED (
    SELECT DISTINCT
        c.publication_id AS next_publication_id, c.subscription_id, c.route, t.publisher_id,
        t.take_id, t.publication_id
    FROM continuation AS c
    JOIN transport AS t ON c.take_id = t.take_id
),
link AS MATERIALIZED (
    SELECT c.path_id, c.route, p.path_id AS parent_path_id, p.publisher_id, p.subscription_id
    FROM chain AS c
    JOIN chain AS p ON c.parent_path_id = p.path_id
),
-- From the end of each flow back to its root, one way of each: that whose list of publications,
-- then of takes, comes first. Ranks among those lists stand for the lists.
trail (
    flow_id, path_id, hop, take_id, publication_id, next_take_id, publications_rank, takes_rank
) AS (
    SELECT f.flow_id, c.path_id, c.depth, f.take_id, t.publication_id, NULL::BIGINT, 1, 1
    FROM flow AS f
    JOIN chain AS c ON f.path_id = c.path_id
    JOIN transport AS t ON f.take_id = t.take_id
    UNION ALL
    SELECT
        flow_id,
        path_id,
        hop,
        take_id,
        publication_id,
        way.next_take_id,
        dense_rank() OVER (ORDER BY flow_id, publication_id, way.publications_rank),
        dense_rank() OVER (ORDER BY flow_id, take_id, way.takes_rank)
    FROM (
        SELECT
            r.flow_id,
            l.parent_path_id AS path_id,
            r.hop - 1 AS hop,
            s.take_id,
            s.publication_id,
            min(struct_pack(
                publications_rank := r.publications_rank,
                takes_rank := r.takes_rank,
                next_take_id := r.take_id
            )) AS way
        FROM trail AS r
        JOIN link AS l ON r.path_id = l.path_id
        JOIN step AS s
            ON r.publication_id = s.next_publication_id
            AND l.route = s.route
            AND l.subscription_id = s.subscription_id
            AND l.publisher_id = s.publisher_id
        GROUP BY r.flow_id, l.parent_path_id, r.hop, s.take_id, s.publication_id
    )
),
whole AS (
    SELECT r.flow_id, r.take_id, r.publication_id, r.next_take_id
    FROM trail AS r
    JOIN flow AS f ON r.flow_id = f.flow_id
    JOIN derive.flow_root AS o ON r.publication_id = o.publication_id
    WHERE r.hop = 1
        AND CASE
            WHEN f.root_kind = 'publication' THEN f.root_id = r.publication_id
            ELSE o.root_kind = 'callback_instance' AND o.root_id = f.root_id
        END
    QUALIFY row_number() OVER (
        PARTITION BY r.flow_id ORDER BY r.publications_rank DESC, r.takes_rank DESC
    ) = 1
),
hop (flow_id, hop, take_id, publication_id, previous_take_id, next_take_id) AS (
    SELECT flow_id, 1::BIGINT, take_id, publication_id, NULL::BIGINT, next_take_id FROM whole
    UNION ALL
    SELECT h.flow_id, r.hop, r.take_id, r.publication_id, h.take_id, r.next_take_id
    FROM hop AS h
    JOIN trail AS r
        ON h.flow_id = r.flow_id AND h.hop + 1 = r.hop AND h.next_take_id = r.take_id
),
-- The callback (or take without one) of the node that each message came out of.
entered AS MATERIALIZED (
    SELECT
        h.flow_id, h.hop, h.publication_id, h.previous_take_id,
        CASE WHEN h.hop = 1 AND f.root_kind = 'callback_instance' THEN f.root_id
            ELSE i.callback_instance_id END AS callback_instance_id
    FROM hop AS h
    JOIN flow AS f ON h.flow_id = f.flow_id
    LEFT JOIN store.callback_instance AS i ON h.previous_take_id = i.take_id
    WHERE h.hop > 1 OR f.root_kind = 'callback_instance'
),
cause AS MATERIALIZED (
    SELECT
        e.flow_id, e.hop, e.publication_id, e.callback_instance_id,
        c.left_id AS publishing_id, c.kind
    FROM entered AS e
    JOIN continuation AS c
        ON e.publication_id = c.publication_id AND e.callback_instance_id = c.entered_id
    QUALIFY row_number() OVER (
        PARTITION BY e.flow_id, e.hop
        ORDER BY c.left_id <> c.entered_id, c.kind <> 'direct', c.left_id
    ) = 1
),
-- Calls of services between the two, from the last one back to the first.
leg (publishing_id, caller_id, level, request_id, service_id, sender_id) AS (
    SELECT c.publishing_id, c.callback_instance_id, 1, i.request_id, c.publishing_id,
        l.callback_instance_id
    FROM (
        SELECT DISTINCT publishing_id, callback_instance_id
        FROM cause
        WHERE publishing_id <> callback_instance_id
    ) AS c
    JOIN store.callback_instance AS i ON c.publishing_id = i.callback_instance_id
    JOIN store.link_request AS l ON i.request_id = l.request_id
    UNION
    SELECT g.publishing_id, g.caller_id, g.level + 1, i.request_id, g.sender_id,
        l.callback_instance_id
    FROM leg AS g
    JOIN store.callback_instance AS i ON g.sender_id = i.callback_instance_id
    JOIN store.link_request AS l ON i.request_id = l.request_id
    WHERE g.sender_id <> g.caller_id
),
call AS (
    SELECT
        c.flow_id, c.hop, g.level, q.sent_ns, q.taken_ns, i.start_ns, i.callback_instance_id
    FROM cause AS c
    JOIN leg AS g
        ON c.publishing_id = g.publishing_id AND c.callback_instance_id = g.caller_id
    JOIN main.request AS q ON g.request_id = q.request_id
    JOIN main.callback_instance AS i ON g.service_id = i.callback_instance_id
),
message AS MATERIALIZED (
    SELECT
        h.flow_id, h.hop, h.publication_id, b.start_ns, b.end_ns, t.taken_ns,
        i.start_ns AS called_ns, i.callback_instance_id,
        list_sort(list_filter(
            [
                {'at_ns': b.intra_ns, 'rank': 1, 'part': 'intra'},
                {'at_ns': b.rclcpp_ns, 'rank': 2, 'part': 'rclcpp'},
                {'at_ns': b.rcl_ns, 'rank': 3, 'part': 'rcl'},
                {'at_ns': b.rmw_ns, 'rank': 4, 'part': 'rmw'},
                {'at_ns': b.dds_ns, 'rank': 5, 'part': 'dds'}
            ],
            lambda layer: layer.at_ns IS NOT NULL
        )) AS layers
    FROM hop AS h
    JOIN main.publication AS b ON h.publication_id = b.publication_id
    JOIN main.take AS t ON h.take_id = t.take_id
    LEFT JOIN main.callback_instance AS i ON h.take_id = i.take_id
),
layer AS (
    SELECT flow_id, hop, publication_id, unnest(layers) AS layer FROM message
),
-- The moments at which a part begins. Those of a hop are in the order of `section`, then `rank`.
moment AS (
    SELECT
        e.flow_id, e.hop, 1 AS section, 0 AS rank, 'callback' AS part,
        coalesce(i.start_ns, t.taken_ns) AS at_ns,
        e.callback_instance_id, NULL::BIGINT AS publication_id
    FROM entered AS e
    LEFT JOIN main.callback_instance AS i ON e.callback_instance_id = i.callback_instance_id
    LEFT JOIN main.take AS t ON e.previous_take_id = t.take_id
    UNION ALL
    SELECT flow_id, hop, 2, -3 * level, 'request_to_take', sent_ns, callback_instance_id, NULL
    FROM call
    WHERE sent_ns IS NOT NULL
    UNION ALL
    SELECT flow_id, hop, 2, 1 - 3 * level, 'take_to_callback', taken_ns, callback_instance_id, NULL
    FROM call
    WHERE taken_ns IS NOT NULL
    UNION ALL
    SELECT flow_id, hop, 2, 2 - 3 * level, 'service', start_ns, callback_instance_id, NULL
    FROM call
    UNION ALL
    SELECT
        c.flow_id, c.hop, 3, 0, 'cache', coalesce(i.end_ns, i.start_ns), d.callback_instance_id,
        c.publication_id
    FROM cause AS c
    JOIN main.callback_instance AS i ON c.publishing_id = i.callback_instance_id
    LEFT JOIN store.link_causal AS d ON c.publication_id = d.publication_id AND d.kind = 'direct'
    WHERE c.kind IN ('periodic_async', 'partial_sync')
    UNION ALL
    SELECT c.flow_id, c.hop, 4, 0, 'callback', i.start_ns, i.callback_instance_id, NULL
    FROM cause AS c
    JOIN store.link_causal AS d ON c.publication_id = d.publication_id AND d.kind = 'direct'
    JOIN main.callback_instance AS i ON d.callback_instance_id = i.callback_instance_id
    WHERE c.kind IN ('periodic_async', 'partial_sync')
    UNION ALL
    SELECT flow_id, hop, 5, 0, 'publish', start_ns, NULL, publication_id
    FROM message
    WHERE start_ns IS DISTINCT FROM layers[1].at_ns
    UNION ALL
    SELECT flow_id, hop, 6, layer.rank, layer.part, layer.at_ns, NULL, publication_id
    FROM layer
    UNION ALL
    SELECT flow_id, hop, 7, 0, 'publish_to_take', end_ns, callback_instance_id, publication_id
    FROM message
    UNION ALL
    SELECT
        m.flow_id, m.hop, 8, 0, 'take_to_callback', m.taken_ns, m.callback_instance_id,
        m.publication_id
    FROM message AS m
    JOIN flow AS f ON m.flow_id = f.flow_id
    JOIN chain AS p ON f.path_id = p.path_id
    WHERE m.called_ns IS NOT NULL AND (m.hop < p.depth OR f.sink_event <> 'take')
    UNION ALL
    SELECT f.flow_id, p.depth + 1, 1, 0, 'callback', m.called_ns, m.callback_instance_id, NULL
    FROM flow AS f
    JOIN chain AS p ON f.path_id = p.path_id
    JOIN message AS m ON f.flow_id = m.flow_id AND p.depth = m.hop
    WHERE f.sink_event = 'callback_end'
    UNION ALL
    SELECT f.flow_id, p.depth + 2, 1, 0, NULL, f.sink_ns, NULL, NULL
    FROM flow AS f
    JOIN chain AS p ON f.path_id = p.path_id
    WHERE f.flow_id IN (SELECT flow_id FROM whole)
),
-- The layers follow each other in time, everything else in the order of causes.
part AS (
    SELECT
        flow_id,
        hop,
        part,
        at_ns,
        callback_instance_id,
        publication_id,
        lead(at_ns) OVER in_order AS to_ns,
        row_number() OVER in_order AS position
    FROM moment
    WINDOW in_order AS (
        PARTITION BY flow_id
        ORDER BY hop, section, CASE WHEN section = 6 THEN at_ns END, rank
    )
)
SELECT
    f.run_id,
    f.path_id,
    f.flow_id,
    f.root_kind,
    f.root_id,
    f.take_id,
    f.latency_ns,
    p.hop,
    p.position,
    p.part,
    p.at_ns AS from_ns,
    p.to_ns,
    p.to_ns - p.at_ns AS duration_ns,
    p.callback_instance_id,
    p.publication_id
FROM part AS p
JOIN flow AS f ON p.flow_id = f.flow_id
WHERE p.part IS NOT NULL
