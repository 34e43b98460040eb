-- description: Later takes at the end of a path that are not arrivals, since a path visits no
--     subscription twice, but that descend from an arrival there through a loop. Any loop through a
--     subscription consists of subscriptions that it leads to and that lead back to it.
-- grain: one row per path and take
-- param: runs
-- param: arrivals BIGINT[][]  Arrivals of main.end_to_end: each pair of path_id and take_id once
-- column: path_id BIGINT  Path, as main.end_to_end numbers it
-- column: take_id
CREATE OR REPLACE MACRO main.looped_arrival(runs, arrivals) AS TABLE
WITH RECURSIVE arrival AS MATERIALIZED (
    SELECT
        arrival[1] AS path_id,
        arrival[2] AS take_id
    FROM (SELECT unnest(arrivals::BIGINT[][]) AS arrival)
),
sink AS MATERIALIZED (
    SELECT DISTINCT a.path_id, t.subscription_id
    FROM arrival AS a
    JOIN store.take AS t ON a.take_id = t.take_id
),
-- The steps of the graph are looked for only where the end of a path goes on.
hop AS MATERIALIZED (
    SELECT DISTINCT
        c.subscription_id AS from_subscription_id,
        t.subscription_id
    FROM derive.continued_pair AS c
    JOIN (
        SELECT DISTINCT run_id, publisher_id, subscription_id FROM derive.flow_transport
    ) AS t ON c.publisher_id = t.publisher_id
    WHERE list_contains(runs, c.run_id) AND list_contains(runs, t.run_id)
),
continued AS MATERIALIZED (
    SELECT DISTINCT subscription_id
    FROM sink
    WHERE subscription_id IN (SELECT from_subscription_id FROM hop)
),
ahead (sink_id, subscription_id) AS (
    SELECT s.subscription_id, h.subscription_id
    FROM continued AS s
    JOIN hop AS h ON s.subscription_id = h.from_subscription_id
    UNION
    SELECT a.sink_id, h.subscription_id
    FROM ahead AS a
    JOIN hop AS h ON a.subscription_id = h.from_subscription_id
),
behind (sink_id, subscription_id) AS (
    SELECT sink_id, sink_id FROM ahead WHERE sink_id = subscription_id
    UNION
    SELECT b.sink_id, h.from_subscription_id
    FROM behind AS b
    JOIN hop AS h ON b.subscription_id = h.subscription_id
),
member AS MATERIALIZED (
    FROM ahead
    INTERSECT
    FROM behind
),
round AS MATERIALIZED (
    SELECT DISTINCT
        a.subscription_id AS from_subscription_id,
        b.subscription_id
    FROM member AS a
    JOIN member AS b ON a.sink_id = b.sink_id
),
edge AS MATERIALIZED (
    SELECT DISTINCT
        c.take_id AS from_take_id,
        t.take_id
    FROM derive.flow_continuation AS c
    JOIN derive.flow_transport AS t ON c.publication_id = t.publication_id
    JOIN round AS r
        ON c.subscription_id = r.from_subscription_id AND t.subscription_id = r.subscription_id
    WHERE list_contains(runs, c.run_id) AND list_contains(runs, t.run_id)
),
-- What is used twice is computed once, not at every step (see derive.graph_reachable).
known AS (SELECT count(*) AS edge_count FROM edge),
descendant (path_id, take_id) AS (
    SELECT a.path_id, a.take_id
    FROM arrival AS a
    JOIN known AS k ON k.edge_count > 0
    JOIN sink AS s ON a.path_id = s.path_id
    WHERE s.subscription_id IN (SELECT sink_id FROM member)
    UNION
    SELECT d.path_id, e.take_id
    FROM descendant AS d
    JOIN edge AS e ON d.take_id = e.from_take_id
)
SELECT d.path_id, d.take_id
FROM descendant AS d
JOIN store.take AS t ON d.take_id = t.take_id
JOIN sink AS s ON d.path_id = s.path_id AND t.subscription_id = s.subscription_id
ANTI JOIN arrival AS a ON d.path_id = a.path_id AND d.take_id = a.take_id
