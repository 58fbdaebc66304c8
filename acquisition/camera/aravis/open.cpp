// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/aravis/open.h"

#include <memory>
#include <thread>

#include "acquisition/camera/aravis_camera.h"

namespace polarscan {
namespace aravis {

Object<ArvCamera> Open(const std::string& name) {
  Failure failure;
  Object<ArvCamera> camera(arv_camera_new(name.c_str(), &failure));
  if (!camera && (!failure || failure.NotFound())) throw NoSuchCamera("the camera is not there", name);
  if (!camera)
    throw Error(fmt::format("the camera cannot be opened ({})", failure.text()), name,
                "polarscan cameras lists those that can be seen; another program may hold it");
  return camera;
}

std::future<Found> Search(const std::string& name, const std::string& hardware, const std::string& serial) {
  auto task = std::make_shared<std::packaged_task<Found()>>([=] {
    arv_update_device_list();
    std::string now = name;
    for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
      if (!hardware.empty() && Text(arv_get_device_physical_id(i)) == hardware)
        now = Text(arv_get_device_address(i));
      if (hardware.empty() && Text(arv_get_device_serial_nbr(i)) == serial) now = Text(arv_get_device_id(i));
    }
    return Found(now, Open(now));
  });
  std::thread([task] { (*task)(); }).detach();
  return task->get_future();
}

}  // namespace aravis

std::vector<CameraInfo> ListAravisCameras() {
  arv_update_device_list();
  std::vector<CameraInfo> cameras;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i)
    cameras.push_back({aravis::Text(arv_get_device_id(i)), aravis::Text(arv_get_device_vendor(i)),
                       aravis::Text(arv_get_device_model(i)), aravis::Text(arv_get_device_serial_nbr(i))});
  return cameras;
}

}  // namespace polarscan
