-- description: Why roots of paths did not arrive: the reason at the step at which they got stuck,
--     and whether the recording may have cut them. It may where no message passed that step later,
--     or, of messages that were published and not taken, none earlier (their readers were not there
--     yet). What became of a message that was taken is recorded until its process ends:
--     `recorded_until_ns`. Nothing is cut where the callback of the message ended without an
--     output, where the node was inactive, where the reader went on without the message, or did
--     not come back from a callback. Whether a callback had an output is not known if events may
--     be missing in it. A publisher that published while its node was inactive does not depend on
--     its state.
-- grain: one row per path and root that did not arrive
-- param: missing VARCHAR  Name of rows of path_id, root_key, publication_id: the root's last one
-- param: lineages VARCHAR  Name of rows of path_id, prefix_id, depth: paths, with their beginnings
-- param: prefixes VARCHAR  Name of rows of path_id, publisher_id, subscription_id, route,
--     is_cached: the last step of each beginning
-- param: reached VARCHAR  Name of rows of path_id, root_key, take_id: how far roots came
-- param: arrived VARCHAR  Name of rows of path_id, take_id: takes at which paths ended
-- param: has_calls
-- param: has_states BOOLEAN = true  Nodes are managed; false: no state of one is looked up
CREATE OR REPLACE MACRO derive.stuck_root(
    missing, lineages, prefixes, reached, arrived, runs, has_calls := true, has_states := true
) AS TABLE
-- How far each root came: its last take on the way, by depth, then time.
WITH progress AS (
    SELECT
        l.path_id, r.root_key,
        max({'depth': l.depth, 'taken_ns': t.taken_ns, 'take_id': r.take_id}) AS last_take
    FROM query_table(reached) AS r
    JOIN query_table(lineages) AS l ON r.path_id = l.prefix_id
    JOIN store.take AS t ON r.take_id = t.take_id
    SEMI JOIN query_table(missing) AS m ON l.path_id = m.path_id AND r.root_key = m.root_key
    GROUP BY l.path_id, r.root_key
),
-- The step at which each root got stuck; none where only the end is missing.
stuck AS (
    SELECT
        m.path_id, m.root_key,
        p.last_take.take_id AS take_id,
        p.last_take.taken_ns AS taken_ns,
        n.publisher_id, n.route, n.subscription_id, n.is_cached,
        CASE WHEN p.last_take IS NULL THEN m.publication_id ELSE c.publication_id END
            AS publication_id
    FROM query_table(missing) AS m
    LEFT JOIN progress AS p ON m.path_id = p.path_id AND m.root_key = p.root_key
    LEFT JOIN query_table(lineages) AS l
        ON m.path_id = l.path_id AND l.depth = coalesce(p.last_take.depth, 0) + 1
    LEFT JOIN query_table(prefixes) AS n ON l.prefix_id = n.path_id
    LEFT JOIN (
        SELECT
            take_id, publisher_id, route,
            max(publication_id) AS publication_id
        FROM derive.flow_continuation
        WHERE list_contains(runs, run_id) AND take_id IN (SELECT last_take.take_id FROM progress)
        GROUP BY take_id, publisher_id, route
    ) AS c
        ON p.last_take.take_id = c.take_id AND n.publisher_id = c.publisher_id AND n.route = c.route
),
-- When messages passed each step, as far as a root got stuck there: each of one clock.
delivered AS (
    SELECT
        t.publisher_id, t.subscription_id,
        min(b.start_ns) AS first_ns,
        max(b.start_ns) AS last_ns
    FROM derive.flow_transport AS t
    JOIN store.publication AS b ON t.publication_id = b.publication_id
    WHERE list_contains(runs, t.run_id) AND t.publisher_id IN (SELECT publisher_id FROM stuck)
    GROUP BY t.publisher_id, t.subscription_id
),
continued AS (
    SELECT
        c.subscription_id, c.publisher_id, c.route,
        max(t.taken_ns) AS last_ns
    FROM derive.flow_continuation AS c
    JOIN store.take AS t ON c.take_id = t.take_id
    WHERE list_contains(runs, c.run_id) AND c.publisher_id IN (SELECT publisher_id FROM stuck)
    GROUP BY c.subscription_id, c.publisher_id, c.route
),
finished AS (
    SELECT
        a.path_id,
        max(t.taken_ns) AS last_ns
    FROM query_table(arrived) AS a
    JOIN store.take AS t ON a.take_id = t.take_id
    WHERE a.path_id IN (SELECT path_id FROM stuck WHERE publisher_id IS NULL)
    GROUP BY a.path_id
),
inactive AS (
    SELECT p.publisher_id, n.start_ns, n.end_ns
    FROM store.publisher AS p
    JOIN derive.node_state AS n ON p.node_id = n.node_id
    WHERE p.publisher_id IN (SELECT publisher_id FROM stuck)
        AND n.state IN ('unconfigured', 'configuring', 'inactive', 'cleaningup', 'finalized')
),
managed AS (
    SELECT publisher_id, start_ns, end_ns
    FROM inactive
    WHERE publisher_id NOT IN (
        SELECT i.publisher_id
        FROM inactive AS i
        JOIN store.publication AS b
            ON i.publisher_id = b.publisher_id AND b.start_ns BETWEEN i.start_ns AND i.end_ns
    )
),
-- A service that was asked, or an answer to another node, may lead to a publication later.
asked AS (
    SELECT callback_instance_id FROM store.link_request WHERE list_contains(runs, run_id)
    UNION
    SELECT callback_instance_id FROM store.link_response WHERE list_contains(runs, run_id)
),
-- Why a message was not followed by a publication, where that is known.
explained AS (
    SELECT
        s.*,
        CASE
            WHEN s.publisher_id IS NULL OR s.publication_id IS NOT NULL OR s.is_cached THEN NULL
            WHEN s.route = [] AND s.taken_ns < i.end_ns THEN 'node_inactive'
            WHEN c.end_ns IS NOT NULL AND NOT c.is_loss_affected
                AND (s.route = [] OR a.callback_instance_id IS NULL) THEN 'no_output'
        END AS withheld
    FROM stuck AS s
    LEFT JOIN store.callback_instance AS c ON s.take_id = c.take_id
    LEFT JOIN (FROM asked WHERE has_calls) AS a ON c.callback_instance_id = a.callback_instance_id
    ASOF LEFT JOIN (FROM managed WHERE has_states) AS i
        ON s.publisher_id = i.publisher_id AND s.taken_ns >= i.start_ns
)
SELECT
    s.path_id, s.root_key,
    CASE
        WHEN s.publisher_id IS NULL THEN 'callback_not_finished'
        WHEN s.publication_id IS NOT NULL THEN coalesce(u.reason, 'unknown')
        ELSE coalesce(s.withheld, 'not_published')
    END AS reason,
    s.publication_id IS NULL AND s.is_cached AS is_cached,
    coalesce(
        CASE
            WHEN s.withheld IS NOT NULL OR u.reason IN ('no_longer_taken', 'reader_in_callback')
                THEN false
            WHEN s.publisher_id IS NULL THEN s.taken_ns > f.last_ns
            WHEN s.publication_id IS NOT NULL THEN
                b.start_ns < d.first_ns OR b.start_ns > d.last_ns
            ELSE s.taken_ns > c.last_ns
        END,
        false
    ) AS is_cut,
    CASE
        WHEN s.publisher_id IS NULL OR s.publication_id IS NULL
            THEN derive.corrected_ns(p.last_seen_ns, k)
    END AS recorded_until_ns
FROM explained AS s
LEFT JOIN store.publication AS b ON s.publication_id = b.publication_id
LEFT JOIN delivered AS d
    ON s.publisher_id = d.publisher_id AND s.subscription_id = d.subscription_id
LEFT JOIN finished AS f ON s.path_id = f.path_id
LEFT JOIN store.undelivered AS u
    ON s.publication_id = u.publication_id AND s.subscription_id = u.subscription_id
LEFT JOIN store.take AS t ON s.take_id = t.take_id
LEFT JOIN store.process AS p ON t.process_id = p.process_id
LEFT JOIN derive.process_clock AS k ON t.process_id = k.process_id
LEFT JOIN continued AS c
    ON t.subscription_id = c.subscription_id
    AND s.publisher_id = c.publisher_id
    AND s.route = c.route
