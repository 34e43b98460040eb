-- title: Nodes of several processes have one name at a time
-- description: Their names go with the host or the process behind them, in all tables, pages and
--     exports, and nothing is added up across them. Topics of one name are one topic: a message of
--     one robot seems to be meant for the subscriptions of the other one, too.
-- cause: Several robots, or several domains (ROS_DOMAIN_ID is not in a trace), are in one run. Or
--     two nodes of one system have the same name by mistake.
-- cure: Read what belongs together as a run of its own, or give each robot a namespace.
-- grain: one row per run
-- severity: warning
-- when: store.node WHERE contains(full_name, '@')
WITH named AS (
    SELECT
        run_id,
        main.node_name(full_name) AS node_name,
        list(DISTINCT split_part(full_name, '@', 2) ORDER BY split_part(full_name, '@', 2))
            AS places
    FROM store.node
    WHERE contains(full_name, '@')
    GROUP BY run_id, node_name
)
SELECT
    run_id,
    count(*) AS count,
    string_agg(
        printf('%s (%s)', node_name, array_to_string(places, ', ')), ', ' ORDER BY node_name
    ) AS detail
FROM named
GROUP BY run_id
