<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<!-- Where the cells of a filled raster come from: original ones let the map below shine through. -->
<qgis version="3.22.0" styleCategories="Symbology">
  <pipe>
    <rasterrenderer type="paletted" band="1" opacity="1" alphaBand="-1" nodataColor="">
      <rasterTransparency/>
      <colorPalette>
        <paletteEntry value="0" label="original" color="#d9d9d9" alpha="60"/>
        <paletteEntry value="1" label="interpolated by MCMD" color="#d6186f" alpha="255"/>
        <paletteEntry value="2" label="void left as it was" color="#000000" alpha="255"/>
        <paletteEntry value="3" label="interpolated along ridges and valleys" color="#e87600" alpha="255"/>
        <paletteEntry value="5" label="interpolated by learned covariance" color="#2854be" alpha="255"/>
        <paletteEntry value="6" label="interpolated by a blend of estimators" color="#7e46b2" alpha="255"/>
        <paletteEntry value="8" label="neighbouring tile" color="#00a4be" alpha="255"/>
        <paletteEntry value="9" label="water held flat" color="#7abef0" alpha="255"/>
        <paletteEntry value="11" label="auxiliary 1" color="#00805c" alpha="255"/>
        <paletteEntry value="12" label="auxiliary 2" color="#54b23e" alpha="255"/>
        <paletteEntry value="13" label="auxiliary 3" color="#b0ce2c" alpha="255"/>
        <paletteEntry value="14" label="auxiliary 4" color="#105e28" alpha="255"/>
        <paletteEntry value="15" label="auxiliary 5" color="#7a9810" alpha="255"/>
        <paletteEntry value="16" label="auxiliary 6" color="#40cc94" alpha="255"/>
        <paletteEntry value="17" label="auxiliary 7" color="#c6e476" alpha="255"/>
        <paletteEntry value="18" label="auxiliary 8" color="#92862c" alpha="255"/>
        <paletteEntry value="19" label="auxiliary 9" color="#deca3c" alpha="255"/>
      </colorPalette>
    </rasterrenderer>
    <brightnesscontrast brightness="0" contrast="0" gamma="1"/>
    <huesaturation saturation="0" grayscaleMode="0" colorizeOn="0"/>
    <rasterresampler maxOversampling="2"/>
    <resamplingStage>resamplingFilter</resamplingStage>
  </pipe>
  <blendMode>0</blendMode>
</qgis>
