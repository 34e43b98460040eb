"""RTAB-Map on two hosts: from a map back to its image, and transforms that make no loop."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from support.ingested import Ingested

LISTENERS = """
SELECT DISTINCT n.full_name, count(*) OVER (PARTITION BY l.publication_id)
FROM link_transport AS l
JOIN publication AS b USING (publication_id)
JOIN publisher AS u USING (publisher_id)
JOIN node AS s ON u.node_id = s.node_id
JOIN take AS t ON l.take_id = t.take_id
JOIN subscription AS r ON t.subscription_id = r.subscription_id
JOIN node AS n ON r.node_id = n.node_id
WHERE u.topic_name = '/tf' AND s.full_name = '/rgbd_odometry'
    AND b.rclcpp_ns < (SELECT max(rclcpp_ns) FROM publication) - 200000000
ORDER BY ALL
"""
PAIRS = """
SELECT p.topics, count(*)
FROM end_to_end(
    [1], NULL, NULL, 'callback_start', 'callback_end', -9223372036854775808, 9223372036854775807
) AS e
JOIN flow_path([1], NULL, NULL) AS p USING (path_id)
WHERE e.take_id IS NOT NULL AND p.is_path
GROUP BY p.topics
ORDER BY p.topics
"""
TRUTH = """
SELECT path, count(*)
FROM truth_end_to_end
GROUP BY path
ORDER BY path
"""


@pytest.fixture
def slam(simulations: Callable[[str], Ingested]) -> Ingested:
    return simulations("rtabmap")


@pytest.mark.thorough
def test_a_map_leads_back_to_one_image_on_the_other_host(slam: Ingested) -> None:
    maps = slam.rows(
        "SELECT take_id FROM take JOIN subscription USING (subscription_id) "
        "WHERE topic_name = '/mapGraph' ORDER BY take_id"
    )
    assert len(maps) > 10
    for (take,) in maps:
        published = slam.rows(
            "SELECT u.topic_name, h.hostname, count(*) "
            f"FROM flow_backward('take', {take}, 32) AS f "
            "JOIN publication AS b ON f.kind = 'publication' AND f.id = b.publication_id "
            "JOIN publisher AS u ON b.publisher_id = u.publisher_id "
            "JOIN process AS p ON b.process_id = p.process_id "
            "JOIN host AS h ON p.host_id = h.host_id WHERE u.topic_name <> '/tf' "
            "GROUP BY ALL ORDER BY ALL"
        )
        assert published[-2:] == [("/mapGraph", "laptop", 1), ("/odom", "scout", 1)]
        # The latest transform may be of the next image.
        assert published[:-2] in [[("/camera/color/image_raw", "scout", n)] for n in (1, 2)]


@pytest.mark.thorough
def test_transforms_reach_three_listeners_and_go_nowhere_by_themselves(slam: Ingested) -> None:
    heard = [
        ("/transform_listener_impl_5566a1b0", 3),
        ("/transform_listener_impl_5581e3d2", 3),
        ("/transform_listener_impl_55d01c40", 3),
    ]
    assert slam.rows(LISTENERS) == heard
    assert slam.rows("SELECT count(*) FROM link_causal WHERE kind = 'take_adjacent'") == [(0,)]


@pytest.mark.thorough
def test_chains_are_those_that_happened(slam: Ingested) -> None:
    found = slam.rows(PAIRS)
    assert found == slam.rows(TRUTH)
    assert [topics for topics, _ in found] == [
        ["/camera/color/image_raw", "/odom", "/mapData"],
        ["/camera/color/image_raw", "/odom", "/mapGraph"],
        ["/camera/color/image_raw", "/odom", "/tf"],
        ["/camera/color/image_raw", "/tf"],
        ["/camera/color/image_raw", "/tf", "/mapGraph"],
    ]
    assert all(count > 10 for _, count in found)
